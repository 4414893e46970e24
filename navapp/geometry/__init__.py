"""Ground floor: frames, cameras, rigs, meshes, the z-buffer. Knows nothing of bones or devices."""

from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair, Rectifier
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.rig_files import read_rig, write_rig
from navapp.geometry.transform import RigidTransform, rotation_angle_deg

__all__ = [
    "Box",
    "Camera",
    "RectifiedGeometry",
    "RectifiedPair",
    "Rectifier",
    "RigQuality",
    "RigidTransform",
    "StereoRig",
    "TriangleMesh",
    "read_rig",
    "rotation_angle_deg",
    "write_rig",
]

"""Other people's trackers, with the settings in use.

A peer gets the rig, the surface of the bone that is left and the pose in the first pair, and then
one pair after the other. It has no registration, no judge and no truth; without a pose in a pair it
goes on from the last one that it had.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from tests.bench.peer_icp import make_gicp, make_open3d
from tests.bench.peer_rapid import RapidSettings, RapidTracker
from tests.bench.peer_stereo import StereoSettings
from tests.bench.peer_visp import PROGRAM, VispTracker

# A pair to the pose of the bone in the left camera; None: it has none.
Follow = Callable[[StereoFrame], RigidTransform | None]
# Rig, surface of the bone, first pair, and left camera from bone in it.
Peer = Callable[[StereoRig, TriangleMesh, StereoFrame, RigidTransform], Follow]

# The best of those that were tried (docs/evaluation.md, Peers).
STEREO = StereoSettings(window_px=5, wls_lambda=None, margin_px=16, margin_mm=30.0, n_points=3000)
RAPID = RapidSettings(n_lines=150, reach_px=5, n_steps=3, least_response=15.0, agree_px=1.5)


def make_peers() -> dict[str, Peer]:
    """All of them, by name; ViSP's where its program was built.

    Raises:
        ModuleNotFoundError: a library of the peers' environment is missing.
    """
    peers: dict[str, Peer] = {
        "SGBM + WLS + Open3D ICP": make_open3d(replace(STEREO, wls_lambda=10.0), (3.0,), (0.7,)),
        "SGBM + GICP": make_gicp(STEREO, (1.0,)),
        "cv2.rapid + RANSAC": partial(RapidTracker, settings=RAPID),
    }
    if PROGRAM.is_file():
        peers["ViSP, KLT on the model"] = partial(VispTracker, n_faces=150)
    return peers

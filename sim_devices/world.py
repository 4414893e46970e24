"""The simulated operating site: an opened knee on the table, seen by two cameras."""

import threading
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from navapp.errors import UsageError
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.anatomy import KneeAnatomy, make_knee, mirror_mesh
from sim_devices.cartilage import make_cartilage_thickness_mm, wear_patch, with_cartilage
from sim_devices.layout import (
    flex_knee,
    left_from_table,
    misplace,
    nominal_table_from_femur,
    select_side,
)
from sim_devices.materials import make_material_table
from sim_devices.motion import LegMotion, compute_drill_motion, compute_sweep_offset_mm
from sim_devices.renderer import DepthPicture, Part, Renderer, Surfaces
from sim_devices.rigs import NO_TURN, Turn, camera_from_left, make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.sensor import Eye
from sim_devices.stages import STAGES, Site, find_entry_point, make_worn_patch
from sim_devices.textures import make_noise_tile
from sim_devices.tissue import SKIN_BELOW_TOP_MM, make_drape, make_tissue, trim

_TISSUE_FOLLOWS = 0.9
# How far from the joint line the surgeon laid the bones bare.
_BARE_FEMUR_MM = 62.0
_BARE_TIBIA_MM = 27.0
_DEFECT_RADIUS_MM = 9.0
_HAND_ABOVE_MM = 32.0
_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
# Direction in the table's frame (z away from the cameras), strength.
_LAMPS = np.array(
    [
        [-480.0, -420.0, -800.0, 0.50],
        [560.0, -260.0, -800.0, 0.34],
        [80.0, 420.0, -1000.0, 0.14],
    ]
)


class World:
    """An operation that runs by itself: bodies move with the time, the stage is set from outside.

    World time 0 is the start. All methods may be called from any thread.

    Args:
        scenario: patient, scene, motion.
        rig: that looks; the default one when absent.

    Raises:
        UsageError: the scenario starts with a stage that does not exist.
    """

    approach_half_angle_deg = 30.0

    def __init__(self, scenario: Scenario, rig: StereoRig | None = None) -> None:
        self.scenario = scenario
        self.rig: StereoRig = rig or make_default_rig()
        self.anatomy: KneeAnatomy = make_knee(scenario.knee)
        self._is_left = scenario.side == "left"
        right = {
            name: mirror_mesh(mesh) if self._is_left else mesh for name, mesh in self._surfaces_mm()
        }
        self._left_from_table = left_from_table(self.rig)
        self._nominal = nominal_table_from_femur()
        self._start = misplace(self._nominal, scenario.seed)
        self._femur_from_tibia = flex_knee(right["femur"], right["tibia"])
        self._motion = LegMotion(scenario.motion, scenario.seed)
        self._site = self._make_site(right)
        self._surfaces = Surfaces(
            make_material_table(scenario.contrast, scenario.blood),
            make_noise_tile(scenario.seed),
            _LAMPS if not self._is_left else _LAMPS * (-1.0, 1.0, 1.0, 1.0),
        )
        self._lock = threading.Lock()
        self._renderers: dict[tuple[str, Eye, float, Turn], Renderer] = {}
        self._others: dict[tuple[str, Camera], Renderer] = {}
        self._parts: dict[str, tuple[Part, ...]] = {}
        self._stage = ""
        self.set_stage(scenario.stage)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies that can be tracked."""
        return ("femur", "tibia")

    @property
    def stage(self) -> str:
        """The surgical stage in force."""
        return self._stage

    @property
    def nominal_left_from_femur(self) -> RigidTransform:
        """Where the femur lies according to the book: the rough start that an operator has."""
        return self._place_in_view(self._nominal)

    @property
    def nominal_left_from_tibia(self) -> RigidTransform:
        """Where the tibia lies according to the book: the knee bent as it is at rest."""
        return self._place_in_view(self._nominal @ self._femur_from_tibia)

    @property
    def approach_axis(self) -> FloatArray:
        """(3,) unit vector in femur model coordinates from the bone towards the cameras."""
        femur_from_left = self.nominal_left_from_femur.inverse()
        middle = 0.5 * self.rig.right_from_left.inverse().translation_mm
        direction = femur_from_left.apply(middle)
        unit: FloatArray = direction / np.linalg.norm(direction)
        return unit

    def set_stage(self, name: str) -> None:
        """Show another surgical stage from the next picture on.

        Raises:
            UsageError: there is no such stage.
        """
        if name not in STAGES:
            raise UsageError(
                f"the simulator shows no stage {name!r}",
                subject=name,
                remedy=f"choose one of {', '.join(STAGES)}",
            )
        with self._lock:
            self._stage = name

    def left_from_body(self, body: str, time_ns: int) -> RigidTransform:
        """True pose of a body in the left camera.

        Args:
            body: one of `bodies`, or another moving thing of the scene.
            time_ns: world time.

        Raises:
            UsageError: there is no such body.
        """
        return self._place_in_view(self._table_from_body(body, time_ns / 1e9))

    def cartilage_mm(self, bone: str) -> FloatArray:
        """(V,) true thickness over the vertices of a bone of the anatomy, worn at the defect.

        Truth: no stage of the line may be handed it.

        Raises:
            UsageError: the anatomy has no such bone.
        """
        mean_mm, seed = self.scenario.cartilage_mm, self.scenario.seed
        thickness = make_cartilage_thickness_mm(self.anatomy, bone, mean_mm, seed)
        if bone == "femur":
            mesh = self.anatomy.bones[bone]
            thickness = wear_patch(mesh, thickness, self._defect_mm(), _DEFECT_RADIUS_MM)
        return thickness

    def render(
        self, eye: Eye, time_ns: int, scale: float = 1.0, turn_rad: Turn = NO_TURN
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance; 1.0 is a full well at nominal exposure.

        Args:
            eye: which camera.
            time_ns: world time.
            scale: of the picture against the rig's.
            turn_rad: of the right eye, about its own axes.
        """
        renderer, parts = self._renderer(eye, scale, turn_rad)
        seen_from = camera_from_left(self.rig, eye, turn_rad)
        return renderer.render(*self._poses(seen_from, parts, time_ns))

    def depth(self, eye: Eye, time_ns: int, scale: float = 1.0) -> DepthPicture:
        """True depth and body of every pixel of the picture that `render` gives."""
        renderer, parts = self._renderer(eye, scale)
        return renderer.depth(*self._poses(camera_from_left(self.rig, eye), parts, time_ns))

    def render_for(
        self, camera: Camera, seen_from: RigidTransform, time_ns: int
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance, as of `render`, for a camera that is not the rig's.

        Args:
            camera: that looks; one that looks often is the same object each time.
            seen_from: camera_from_left, of where it stands; it never moves.
            time_ns: world time.
        """
        renderer, parts = self._renderer_for(camera)
        return renderer.render(*self._poses(seen_from, parts, time_ns))

    def _renderer(
        self, eye: Eye, scale: float, turn_rad: Turn = NO_TURN
    ) -> tuple[Renderer, tuple[Part, ...]]:
        """That of an eye as it stands: what lies still is drawn once and kept."""
        with self._lock:
            parts = self._parts_now()
            key = (self._stage, eye, scale, turn_rad)
            if key not in self._renderers:
                rig = self.rig if scale == 1.0 else self.rig.scale(scale)
                camera = rig.left if eye == "left" else rig.right
                self._renderers[key] = self._make_renderer(camera, parts, scale)
            return self._renderers[key], parts

    def _renderer_for(self, camera: Camera) -> tuple[Renderer, tuple[Part, ...]]:
        """That of another camera, kept likewise."""
        with self._lock:
            parts = self._parts_now()
            key = (self._stage, camera)
            if key not in self._others:
                self._others[key] = self._make_renderer(camera, parts)
            return self._others[key], parts

    def _make_renderer(
        self, camera: Camera, parts: tuple[Part, ...], scale: float = 1.0
    ) -> Renderer:
        return Renderer(camera, parts, self._surfaces_at(scale), frozenset({"drape"}))

    def _parts_now(self) -> tuple[Part, ...]:
        """Of the stage in force; called with the lock held."""
        if self._stage not in self._parts:
            made = STAGES[self._stage](self._site)
            self._parts[self._stage] = tuple(self._mirror_if_left(part) for part in made)
        return self._parts[self._stage]

    def _surfaces_at(self, scale: float) -> Surfaces:
        """Smaller pictures need a blurred texture, or its finest octave would flicker."""
        if scale >= 0.8:
            return self._surfaces
        blur = 0.6 * (1.0 / scale - 1.0)
        tile = make_noise_tile(self.scenario.seed, round(blur, 1))
        return Surfaces(self._surfaces.materials, tile, self._surfaces.lamps)

    def _poses(
        self, seen_from: RigidTransform, parts: tuple[Part, ...], time_ns: int
    ) -> tuple[dict[str, RigidTransform], RigidTransform]:
        """camera_from_body of everything in the scene, and camera_from_table."""
        poses = {
            body: seen_from @ self.left_from_body(body, time_ns)
            for body in dict.fromkeys(part.body for part in parts)
        }
        return poses, seen_from @ self._left_from_table

    def _table_from_body(self, body: str, time_s: float) -> RigidTransform:
        """As for a right knee."""
        twist = self._motion.twist(time_s)
        centre = self._start.translation_mm
        femur = self._start.move(twist, centre)
        if body == "femur":
            return femur
        if body == "tibia":
            bend = rotation_from_vector((self._motion.bend_rad(time_s), 0.0, 0.0))
            turned = RigidTransform.from_parts("femur", "femur", bend, np.zeros(3))
            return femur @ turned @ self._femur_from_tibia
        if body == "tissue":
            rest = RigidTransform.identity("table", "tissue")
            return rest.move(_TISSUE_FOLLOWS * twist, centre)
        if body == "drape":
            return RigidTransform.identity("table", "drape")
        if body == "hand":
            offset = compute_sweep_offset_mm(self.scenario.instrument, time_s)
            height = float(self._site.tissue.mesh.vertices_mm[:, 2].min()) - _HAND_ABOVE_MM
            return RigidTransform.from_parts(
                "table", "hand", np.eye(3), offset + np.array([0.0, 0.0, height])
            )
        if body in ("drill", "chuck"):
            site = self._site
            tool = compute_drill_motion(
                site.entry_mm, site.entry_axis, time_s, turns=body == "drill"
            )
            return femur @ RigidTransform("femur", body, tool)
        raise UsageError(
            f"there is no body {body!r} in the simulated world",
            subject=body,
            remedy=f"choose one of {', '.join(self.bodies)}",
        )

    def _place_in_view(self, table_from_body: RigidTransform) -> RigidTransform:
        """left_from_body of a pose that was made as for a right knee."""
        if self._is_left:
            table_from_body = RigidTransform(
                "table", table_from_body.source, _MIRROR @ table_from_body.matrix @ _MIRROR
            )
        return self._left_from_table @ table_from_body

    @property
    def drill_line(self) -> tuple[FloatArray, FloatArray]:
        """Where the drill enters the femur and its unit direction into it, (3,) each."""
        mirror = np.array([-1.0 if self._is_left else 1.0, 1.0, 1.0])
        return self._site.entry_mm * mirror, self._site.entry_axis * mirror

    @property
    def worn_vertices(self) -> NDArray[np.int64]:
        """Vertices of the femur's bone where its cartilage is mostly worn away, as a CT shows."""
        return np.flatnonzero(self._site.worn > 0.5).astype(np.int64)

    def _mirror_if_left(self, part: Part) -> Part:
        if not self._is_left:
            return part
        return Part(
            part.body, mirror_mesh(part.mesh), part.material, part.mark, part.exposure, -1.0
        )

    def _defect_mm(self) -> FloatArray:
        """(3,) middle of the worn patch: on the medial condyle, in front of its lowest point."""
        condyle = self.anatomy.landmarks["femur/medial_condyle"]
        middle: FloatArray = condyle + np.array([0.0, -6.0, 0.0])
        return middle

    def _surfaces_mm(self) -> Iterator[tuple[str, TriangleMesh]]:
        """The bones as a camera sees them: with their cartilage."""
        for name, bone in self.anatomy.bones.items():
            yield name, with_cartilage(bone, self.cartilage_mm(name))

    def _make_site(self, right: dict[str, TriangleMesh]) -> Site:
        femur = self._start
        laid = {"femur": femur, "tibia": femur @ self._femur_from_tibia}
        on_table = [right[name].transform(pose) for name, pose in laid.items()]
        bare = [
            select_side(
                right["femur"], float(right["femur"].vertices_mm[:, 2].min()) + _BARE_FEMUR_MM, -1.0
            ),
            select_side(
                right["tibia"], float(right["tibia"].vertices_mm[:, 2].max()) - _BARE_TIBIA_MM, 1.0
            ),
        ]
        exposed = [mesh.transform(pose) for mesh, pose in zip(bare, laid.values(), strict=True)]
        tissue = make_tissue(exposed, on_table, self.scenario.seed)
        top = -min(float(bone.vertices_mm[:, 2].min()) for bone in on_table)
        mirror = np.array([-1.0, 1.0, 1.0]) if self._is_left else np.ones(3)
        notch = self.anatomy.landmarks["femur/notch"] * mirror
        axis = rotation_from_vector((np.radians(-6.0), 0.0, 0.0)) @ (0.0, 0.0, 1.0)
        return Site(
            bones=right,
            worn=make_worn_patch(right["femur"], self._defect_mm() * mirror, _DEFECT_RADIUS_MM),
            is_covered=self.scenario.cartilage_mm > 0.0,
            tissue=trim(tissue),
            drape=make_drape(tissue, top - SKIN_BELOW_TOP_MM - 11.0, self.scenario.seed),
            entry_mm=find_entry_point(right["femur"], notch + np.array([0.0, -10.0, 0.0]), axis),
            entry_axis=axis,
        )

"""The simulated operating site: an opened knee on the table, seen by two cameras."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.errors import UsageError
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.anatomy import MIRROR, KneeAnatomy, make_knee, mirror_mesh
from sim_devices.cartilage import (
    make_cartilage_thickness_mm,
    make_worn_patch,
    wear_patch,
    with_cartilage,
)
from sim_devices.drift import compute_drift_mm
from sim_devices.fitted_parts import FittedParts
from sim_devices.kept_scenes import STILL, KeptScenes
from sim_devices.layout import left_from_table, mirror_pose, misplace, nominal_table_from_femur
from sim_devices.materials import make_material_table
from sim_devices.motion import LegMotion, compute_drill_motion, compute_sweep_offset_mm
from sim_devices.operation import State, enter
from sim_devices.operation_record import OperationRecord
from sim_devices.picture_motion import compute_path_px
from sim_devices.planned_cuts import Cut
from sim_devices.renderer import DepthPicture, Surfaces
from sim_devices.rigs import (
    NO_TURN,
    Turn,
    camera_from_left,
    make_default_rig,
)
from sim_devices.scenario import Scenario
from sim_devices.sensor import Eye, Rows
from sim_devices.shake import ArmShake
from sim_devices.site import Site, make_site
from sim_devices.state_history import StateHistory
from sim_devices.textures import make_noise_tile

_TISSUE_FOLLOWS = 0.9
_DEFECT_RADIUS_MM = 9.0
_HAND_ABOVE_MM = 32.0
# What lies in the room and not on the leg.
_BESIDE_LEG = frozenset({"drape", "hand"})
# Of the vertices of a part, so many say how fast it moves in the picture.
_N_WATCHED = 150
# What lies still is drawn anew only when the rig's shake may have moved it by so much.
_STILL_STEP_PX = 0.25
# Of the size of the pictures in which the rows of a body are looked for.
_COARSE = 0.25
# Direction in the table's frame (z away from the cameras), strength.
_LAMPS = np.array(
    [
        [-480.0, -420.0, -800.0, 0.50],
        [560.0, -260.0, -800.0, 0.34],
        [80.0, 420.0, -1000.0, 0.14],
    ]
)


class World:
    """An operation that runs by itself: bodies move with the time, steps are made from outside.

    World time 0 is the start. All methods may be called from any thread.

    Args:
        scenario: patient, scene, motion.
        rig: that looks; the default one when absent.

    Attributes:
        states: which stage is shown, and what is made in it.
        record: what is planned and what is really made: truth.

    Raises:
        UsageError: the scenario starts with a stage that does not exist.
    """

    approach_half_angle_deg = 30.0

    def __init__(self, scenario: Scenario, rig: StereoRig | None = None) -> None:
        self.scenario = scenario
        self.rig: StereoRig = rig or make_default_rig()
        self.anatomy: KneeAnatomy = make_knee(scenario.knee)
        self._is_left = scenario.side == "left"
        # What mirrors a point of a right knee when this is a left one.
        self._sides = MIRROR if self._is_left else np.ones(3)
        right = {
            name: mirror_mesh(mesh) if self._is_left else mesh for name, mesh in self._surfaces_mm()
        }
        self._left_from_table = left_from_table(self.rig, scenario.distance_mm)
        self._nominal = nominal_table_from_femur()
        self._start = misplace(self._nominal, scenario.seed)
        self._motion = LegMotion(scenario.motion, scenario.seed)
        self._shake = ArmShake(scenario.shake_mm, scenario.shake_hz, scenario.seed)
        fastest_px_s = self._shake.compute_speed_px_s(self.rig.left.focal_px, scenario.distance_mm)
        self._still_step_ns = max(
            1, round(1e9 * _STILL_STEP_PX / max(fastest_px_s, _STILL_STEP_PX))
        )
        self._site = self._make_site(right)
        self._fitted = FittedParts(self._site)
        self.record = OperationRecord(self._site, self._fitted, is_left=self._is_left)
        surfaces = Surfaces(
            make_material_table(scenario.contrast, scenario.blood, scenario.highlights),
            make_noise_tile(scenario.seed),
            _LAMPS if not self._is_left else _LAMPS * (-1.0, 1.0, 1.0, 1.0),
        )
        self._scenes = KeptScenes(
            self.rig, self._site, self._fitted, surfaces, scenario.seed, self._is_left
        )
        self.states = StateHistory(enter(scenario.stage))

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies that can be tracked."""
        return ("femur", "tibia", "patella")

    @property
    def planned_cuts(self) -> dict[str, Cut]:
        """All cuts of the operation as they are planned, by name."""
        return self.record.planned_cuts

    @property
    def planned_parts(self) -> dict[str, TriangleMesh]:
        """The components where they are planned, in the coordinates of their bones, by name."""
        return self.record.planned_parts

    @property
    def drill_line(self) -> tuple[FloatArray, FloatArray]:
        """Where the drill is planned to enter the femur, and its unit direction, (3,) each."""
        return self.record.planned_hole

    @property
    def nominal_left_from_femur(self) -> RigidTransform:
        """Where the femur lies according to the book: the rough start that an operator has."""
        return self._place_in_view(self._nominal)

    @property
    def nominal_left_from_tibia(self) -> RigidTransform:
        """Where the tibia lies according to the book: the knee bent as it is at rest."""
        return self._place_in_view(self._nominal @ self._site.femur_from_tibia)

    @property
    def nominal_left_from_patella(self) -> RigidTransform:
        """Where the patella lies according to the book: turned over, beside the femur."""
        return self._place_in_view(self._nominal @ self._site.femur_from_patella)

    @property
    def approach_axis(self) -> FloatArray:
        """(3,) unit vector in femur model coordinates from the bone towards the cameras."""
        femur_from_left = self.nominal_left_from_femur.inverse()
        middle = 0.5 * self.rig.right_from_left.inverse().translation_mm
        direction = femur_from_left.apply(middle)
        unit: FloatArray = direction / np.linalg.norm(direction)
        return unit

    @property
    def _state(self) -> State:
        return self.states.now

    def left_from_body(self, body: str, time_ns: int) -> RigidTransform:
        """True pose of a body in the left camera.

        Args:
            body: one of `bodies`, or another moving thing of the scene.
            time_ns: world time.

        Raises:
            UsageError: there is no such body.
        """
        return self._left_from_body(body, time_ns, self.states.at(time_ns))

    def _left_from_body(self, body: str, time_ns: int, state: State) -> RigidTransform:
        return self._shake.left_from_rest(time_ns / 1e9) @ self._rest_from_body(
            body, time_ns, state
        )

    def _rest_from_body(self, body: str, time_ns: int, state: State) -> RigidTransform:
        """In the left camera as it stands while nothing shakes."""
        table_from_body = self._table_from_body(body, time_ns / 1e9, state)
        drift_mm = compute_drift_mm(self.scenario.drift_mm_s, time_ns / 1e9)
        if drift_mm != 0.0 and body not in _BESIDE_LEG:
            twist = np.array([drift_mm, 0.0, 0.0, 0.0, 0.0, 0.0])
            table_from_body = table_from_body.move(twist, np.zeros(3))
        return self._place_in_view(table_from_body)

    def seen_ns(self, body: str, time_ns: int) -> int:
        """When the middle row of a body's box in the left picture is at mid exposure.

        The box holds all of the body that the picture shows of it.

        Args:
            body: one of `bodies`.
            time_ns: world time at which the middle row of the picture is.
        """
        if self.rig.row_delay_ns == 0:
            return time_ns
        picture = self._depth("left", time_ns, _COARSE, self.states.at(time_ns))
        rows = picture.find_middle_row(body) / _COARSE
        return time_ns + round(rows * self.rig.row_delay_ns)

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

    def surface(self, bone: str) -> TriangleMesh:
        """A bone as a camera sees it before any cut: with its cartilage, bone coordinates."""
        return dict(self._surfaces_mm())[bone]

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance; 1.0 is a full well at nominal exposure.

        Args:
            eye: which camera.
            time_ns: world time.
            scale: of the picture against the rig's.
            turn_rad: of the right eye, about its own axes.
            rows: only these need be right; None: all.
        """
        state = self.states.take_picture(time_ns)
        renderer = self._scenes.renderer(state, eye, scale, turn_rad)
        seen_from = camera_from_left(self.rig, eye, turn_rad)
        return renderer.render(*self._poses(seen_from, state, time_ns), rows)

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """The longest way that anything goes in the left picture (full size) in an interval."""
        state, longest_px = self._state, 0.0
        for part in self._scenes.scene(state).parts:
            if part.body not in STILL or not self._shake.is_still:
                vertices_mm = part.mesh.vertices_mm
                watched_mm = vertices_mm[:: max(1, len(vertices_mm) // _N_WATCHED)]
                pose = partial(self._left_from_body, part.body, state=state)
                path_px = compute_path_px(self.rig.left, watched_mm, pose, from_ns, until_ns)
                longest_px = max(longest_px, path_px)
        return longest_px

    def depth(self, eye: Eye, time_ns: int, scale: float = 1.0) -> DepthPicture:
        """True depth and body of every pixel of the picture that `render` gives."""
        return self._depth(eye, time_ns, scale, self._state)

    def _depth(self, eye: Eye, time_ns: int, scale: float, state: State) -> DepthPicture:
        renderer = self._scenes.renderer(state, eye, scale)
        return renderer.depth(*self._poses(camera_from_left(self.rig, eye), state, time_ns))

    def render_for(
        self, camera: Camera, seen_from: RigidTransform, time_ns: int
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance, as of `render`, for a camera that is not the rig's.

        Args:
            camera: that looks; one that looks often is the same object each time.
            seen_from: camera_from_left while nothing shakes, of where it stands; it never moves.
            time_ns: world time.
        """
        state = self._state
        renderer = self._scenes.renderer_for(state, camera)
        poses = {
            body: seen_from @ self._rest_from_body(body, time_ns, state)
            for body in self._bodies_of(state)
        }
        return renderer.render(poses, seen_from @ self._left_from_table)

    def _poses(
        self, seen_from: RigidTransform, state: State, time_ns: int
    ) -> tuple[dict[str, RigidTransform], RigidTransform]:
        """camera_from_body of all that is in the scene, and camera_from_table of the still step."""
        step_ns = self._still_step_ns
        still_ns = round(time_ns / step_ns) * step_ns
        poses = {
            body: seen_from
            @ self._left_from_body(body, still_ns if body in STILL else time_ns, state)
            for body in self._bodies_of(state)
        }
        left_from_rest = self._shake.left_from_rest(still_ns / 1e9)
        return poses, seen_from @ left_from_rest @ self._left_from_table

    def _bodies_of(self, state: State) -> tuple[str, ...]:
        return tuple(dict.fromkeys(part.body for part in self._scenes.scene(state).parts))

    def _table_from_body(self, body: str, time_s: float, state: State) -> RigidTransform:
        """As for a right knee."""
        twist = self._motion.twist(time_s)
        centre = self._start.translation_mm
        femur = self._start.move(twist, centre)
        if body == "femur":
            return femur
        if body == "tibia":
            bend = rotation_from_vector((self._motion.bend_rad(time_s), 0.0, 0.0))
            turned = RigidTransform.from_parts("femur", "femur", bend, np.zeros(3))
            return femur @ turned @ self._femur_from_tibia(state)
        if body in ("tissue", "patella"):
            # The patella that is turned over lies on tissue, and moves with it.
            rest = RigidTransform.identity("table", "tissue")
            if body == "patella":
                rest = self._start @ self._site.femur_from_patella
            return rest.move(_TISSUE_FOLLOWS * twist, centre)
        if body == "drape":
            return RigidTransform.identity("table", "drape")
        if body == "hand":
            offset = compute_sweep_offset_mm(self.scenario.instrument, time_s)
            height = self._scenes.scene(state).tissue_top_mm - _HAND_ABOVE_MM
            place = offset + self._middle_of_site_mm(state) + np.array([0.0, 0.0, height])
            return RigidTransform.from_parts("table", "hand", np.eye(3), place)
        if body in ("drill", "chuck"):
            entry_mm, axis = self._site.made_hole
            tool = compute_drill_motion(entry_mm, axis, time_s, turns=body == "drill")
            return femur @ RigidTransform("femur", body, tool)
        raise UsageError(
            f"there is no body {body!r} in the simulated world",
            subject=body,
            remedy=f"choose one of {', '.join(self.bodies)}",
        )

    def _middle_of_site_mm(self, state: State) -> FloatArray:
        """(3,) what a hand is held over: the middle of the knee, or of the patella beside it."""
        if state.stage != "patella":
            return np.zeros(3)
        middle_mm = self.anatomy.bones["patella"].centroid_mm * self._sides
        x_mm, y_mm, _ = (self._start @ self._site.femur_from_patella).apply(middle_mm)
        return np.array([x_mm, y_mm, 0.0])

    def _place_in_view(self, table_from_body: RigidTransform) -> RigidTransform:
        """left_from_body of a pose that was made as for a right knee."""
        if self._is_left:
            table_from_body = mirror_pose(table_from_body)
        return self._left_from_table @ table_from_body

    def _femur_from_tibia(self, state: State) -> RigidTransform:
        """At rest."""
        return (self._fitted if state.is_made("spacer") else self._site).femur_from_tibia

    @property
    def worn_vertices(self) -> NDArray[np.int64]:
        """Vertices of the femur's bone where its cartilage is mostly worn away, as a CT shows."""
        return np.flatnonzero(self._site.worn > 0.5).astype(np.int64)

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
        centre_mm = self._defect_mm() * self._sides
        return make_site(
            make_knee(replace(self.scenario.knee, side="right")),
            right,
            make_worn_patch(right["femur"], centre_mm, _DEFECT_RADIUS_MM),
            self._start,
            self.scenario.seed,
            is_covered=self.scenario.cartilage_mm > 0.0,
            misses=self.scenario.misses,
        )

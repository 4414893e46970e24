"""Simulated operations in which something goes wrong on purpose, frame by frame with the truth."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tracking import Goal, Tracker, TrackState
from navapp.values import BoneModel, Prior, Status, TrackedFrame
from sim_devices.motion import LegMotion, smooth_step
from sim_devices.scenario import Scenario
from sim_devices.sensor import Eye, SensorModel
from sim_devices.world import World
from tests.knees import femur_of, nominal_prior, stepped_camera

GOAL = Goal(np.empty((0, 3)), 2.0)
_COVER_ABOVE_MM = 25.0
_COVER_SLIDES_S = 0.2
_COVER_PX_PER_MM, _COVER_LEVEL, _COVER_CONTRAST = 4.0, 0.25, 0.1


@dataclass(frozen=True)
class Event:
    """What goes wrong between two moments.

    Attributes:
        name: for people.
        start_s, end_s: of the disturbance; the bone has moved by its end.
        covered_share: of the bone's visible points behind a sheet that slides in and out.
        blur_px: standard deviation, both pictures.
        light: of both pictures, 1 is undisturbed.
        blocked: the eye that sees nothing.
        moved_mm, moved_deg: how far the bone goes: at once at `start_s`, or unseen until `end_s`.
    """

    name: str
    start_s: float = 1.0
    end_s: float = 2.0
    covered_share: float = 0.0
    blur_px: float = 0.0
    light: float = 1.0
    blocked: Eye | None = None
    moved_mm: float = 0.0
    moved_deg: float = 0.0

    def is_on(self, time_s: float) -> bool:
        """Whether it happens at that moment."""
        return self.start_s <= time_s < self.end_s


@dataclass
class Moved(LegMotion):
    """A breathing leg that goes elsewhere, in a direction of its own, at the event's start."""

    event: Event
    seed: int

    def __post_init__(self) -> None:
        super().__init__("breathing", self.seed)
        way = np.random.default_rng([self.seed, 61]).standard_normal((2, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        lengths = (self.event.moved_mm, np.radians(self.event.moved_deg))
        self._way = np.concatenate([way[0] * lengths[0], way[1] * lengths[1]])

    def twist(self, time_s: float) -> FloatArray:
        """As a leg's, and all the way at once."""
        is_there = time_s >= self.event.start_s
        moved: FloatArray = super().twist(time_s) + is_there * self._way
        return moved


@lru_cache(maxsize=1)
def _world(seed: int) -> World:
    """Kept: it takes longer to make than its frames."""
    side = "left" if seed % 2 else "right"
    return World(Scenario(seed=seed, side=side, motion="breathing"))


@dataclass
class Theatre:
    """A world with an event in it, as a camera sees it; one at a time."""

    seed: int
    event: Event
    world: World = field(init=False)

    def __post_init__(self) -> None:
        self.world = _world(self.seed)
        self.world._motion = Moved(self.event, self.seed)
        noise = np.random.default_rng([self.seed, 62]).standard_normal((512, 512))
        texture = cv2.GaussianBlur(noise.astype(np.float32), (0, 0), 1.5)
        self._texture = texture / texture.std()
        self._rays: dict[str, FloatArray] = {}

    @property
    def rig(self):
        """Of the world."""
        return self.world.rig

    @property
    def bone(self) -> BoneModel:
        """The right plan."""
        return femur_of(self.world)

    @property
    def prior(self) -> Prior:
        """The nominal pose."""
        return nominal_prior(self.world)

    def truth(self, time_ns: int) -> RigidTransform:
        """Of the femur."""
        return self.world.left_from_body("femur", time_ns)

    def render(self, eye: Eye, time_ns: int, *how: Any) -> np.ndarray:
        """As the world's, disturbed while the event lasts."""
        event, time_s = self.event, time_ns / 1e9
        radiance = self.world.render(eye, time_ns, *how)
        if not event.is_on(time_s):
            return radiance
        if event.covered_share:
            radiance = self._covered(radiance, eye, time_ns)
        if event.blur_px:
            radiance = cv2.GaussianBlur(radiance, (0, 0), event.blur_px)
        is_blocked = event.blocked == eye
        return radiance * np.float32(0.0 if is_blocked else event.light)

    def _covered(self, radiance: np.ndarray, eye: Eye, time_ns: int) -> np.ndarray:
        """With a textured sheet in front of the bone, up to a line that leaves the rest open."""
        truth, event, time_s = self.truth(time_ns), self.event, time_ns / 1e9
        mesh = self.bone.mesh
        seen_mm = truth.apply(mesh.vertices_mm[mesh.visible_vertices(truth)])
        height_mm = float(seen_mm[:, 2].min()) - _COVER_ABOVE_MM
        slid_in = smooth_step((time_s - event.start_s) / _COVER_SLIDES_S)
        slid_in *= smooth_step((event.end_s - time_s) / _COVER_SLIDES_S)
        # Along the left camera's rays so many of them lie left of the line.
        across_mm = seen_mm[:, 0] * height_mm / seen_mm[:, 2]
        edge_mm = np.quantile(across_mm, slid_in * event.covered_share)
        place_mm = self._on_sheet(eye, height_mm).reshape(*radiance.shape[:2], 2)
        in_texture = (_COVER_PX_PER_MM * place_mm).astype(np.float32)
        texture = cv2.remap(
            self._texture, in_texture, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP
        )
        sheet = np.clip(_COVER_LEVEL * (1.0 + _COVER_CONTRAST * texture), 0.0, 1.0)
        is_sheet = place_mm[..., 0] < edge_mm
        return np.where(is_sheet[..., None], sheet[..., None], radiance).astype(np.float32)

    def _on_sheet(self, eye: Eye, height_mm: float) -> FloatArray:
        """(N, 2) mm, where each pixel's ray meets a plane across the left camera's axis."""
        rig = self.rig
        left_from_eye = (
            RigidTransform.identity("left", "left")
            if eye == "left"
            else rig.right_from_left.inverse()
        )
        if eye not in self._rays:
            camera = rig.left if eye == "left" else rig.right
            rows, columns = np.mgrid[: camera.height, : camera.width]
            pixels = np.column_stack([columns.ravel(), rows.ravel()])
            self._rays[eye] = left_from_eye.rotate(camera.rays(pixels))
        rays, origin = self._rays[eye], left_from_eye.translation_mm
        along = (height_mm - origin[2]) / rays[:, 2]
        return origin[:2] + along[:, None] * rays[:, :2]


@dataclass(frozen=True)
class Shown:
    """One frame, what the tracker answered, and how far off that was.

    Attributes:
        time_s: of the capture.
        tracked: the answer.
        tre_mm: NaN without a pose.
        took_ms: the answer.
    """

    time_s: float
    tracked: TrackedFrame
    tre_mm: float
    took_ms: float

    @property
    def is_ok(self) -> bool:
        """Whether it would be shown."""
        return self.tracked.verdict.status is Status.OK


def played(theatre: Theatre, tracker: Tracker, rate_hz: float, until_s: float) -> Iterator[Shown]:
    """Register in the first frame, then track, as the controller does: by the capture times."""
    camera = stepped_camera(theatre, SensorModel(seed=theatre.seed), rate_hz)
    state: TrackState | None = None
    bone = theatre.bone
    while True:
        frame = camera.read(1.0)
        world_ns = camera.world_time_ns(frame.captured_ns)
        if world_ns >= until_s * 1e9:
            return
        started = time.perf_counter()
        if state is None:
            tracked = tracker.register(frame, theatre.prior, GOAL)[0]
            # Even what is not OK is taken: nothing here is easier than an operation.
            start = tracked.left_from_bone or theatre.prior.left_from_bone["femur"]
            state = TrackState.at_rest(start, frame.captured_ns)
        else:
            tracked, state = tracker.track(frame, state, GOAL)
        took_ms = 1e3 * (time.perf_counter() - started)
        pose = tracked.left_from_bone
        tre_mm = (
            np.nan
            if pose is None
            else compute_mean_tre_mm(pose, theatre.truth(world_ns), bone, np.empty((0, 3)))
        )
        yield Shown(world_ns / 1e9, tracked, tre_mm, took_ms)

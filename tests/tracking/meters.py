"""A surface meter that sees a bone without pictures, and a stopwatch that notes its laps."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.frame import Frame
from navapp.tracking.surface_meter import Margins, Measurement
from navapp.values import BoneModel, DisparityMap, Stopwatch
from tests.registration.kernel_cases import find_vertices
from tests.registration.shapes import TRUE, as_cloud, grid_mesh

NO_MAP = DisparityMap(*np.empty((2, 0, 0), np.float32), np.empty((0, 0), np.uint8), 0, 0)


def height_mm(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.008 * x**2 + 0.012 * y**2 + 1.5 * np.sin(x / 8.0) * np.cos(y / 9.0)


MODEL = RegistrationModel(BoneModel("femur", grid_mesh(height_mm), "right"))


def moved(mm: tuple[float, float, float], deg: tuple[float, float, float]) -> RigidTransform:
    """`TRUE`, moved about the bone's centre."""
    return TRUE.move((*mm, *np.radians(deg)), TRUE.apply(MODEL.centre_mm))


def error_mm(pose: RigidTransform, true: RigidTransform = TRUE) -> float:
    """Mean displacement of the model's surface."""
    offset_mm = pose.apply(MODEL.points_mm) - true.apply(MODEL.points_mm)
    return float(np.linalg.norm(offset_mm, axis=1).mean())


class Laps(Stopwatch):
    """Notes which parts it was told of."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []

    def lap(self, part) -> None:
        self.parts.append(part)
        super().lap(part)


def frame_at(start: RigidTransform, watch: Stopwatch | None = None, **more) -> Frame:
    """Of no pictures: what these meters are handed is not looked at."""
    return Frame(None, None, start, watch or Stopwatch(), **more)


@dataclass
class FakeExpected:
    """A model at a pose."""

    pose: RigidTransform


class FakeMeter:
    """Sees a bone that lies at `true`; notes which matchings it was asked for.

    Freely it sees all of it, but too far away by `free_bias_mm`. On the model it answers where the
    model lies within `REACH_MM` of the surface, unless `share` tells it how much to claim. It knows
    no other matcher than its own.
    """

    REACH_MM = 1.5
    model = MODEL

    def __init__(self, true: RigidTransform = TRUE, free_bias_mm: float = 0.0) -> None:
        self.true = true
        self.free_bias_mm = free_bias_mm
        self.share: float | None = None
        self.is_in_view = True
        self.n_points = 1200
        self.asked: list[str] = []
        self.answers: list[Measurement] = []
        self.n_rendered = 0
        self.margins: list[Margins] = []

    def measure_freely(self, pair, pose, margins) -> Measurement | None:
        self.asked.append("freely")
        self.margins.append(margins)
        if not self.is_in_view:
            return None
        return self._measurement(self._points_mm() + np.array([0.0, 0.0, self.free_bias_mm]), 1.0)

    def render(self, pair, pose, margins) -> FakeExpected | None:
        self.margins.append(margins)
        self.n_rendered += self.is_in_view
        return FakeExpected(pose) if self.is_in_view else None

    def measure_on_model(self, expected: FakeExpected) -> Measurement:
        return self._near_the_model("on_model", expected)

    def measure_on_samples(self, expected: FakeExpected) -> Measurement:
        return self._near_the_model("sampled", expected)

    def _near_the_model(self, what: str, expected: FakeExpected) -> Measurement:
        self.asked.append(what)
        points_mm = self._points_mm()
        is_near = self._is_near(points_mm, expected.pose)
        return self._measurement(points_mm[is_near], self._share(is_near))

    def _is_near(self, points_mm: np.ndarray, pose: RigidTransform) -> np.ndarray:
        at_bone = pose.inverse().apply(points_mm)
        index, distance_mm = find_vertices(at_bone, MODEL)
        offset_mm = np.einsum("ij,ij->i", at_bone - MODEL.points_mm[index], MODEL.normals[index])
        return np.isfinite(distance_mm) & (np.abs(offset_mm) < self.REACH_MM)

    def _share(self, is_near: np.ndarray) -> float:
        return float(is_near.mean()) if self.share is None else self.share

    def _points_mm(self) -> np.ndarray:
        """Every measurement has another noise."""
        rng = np.random.default_rng(len(self.asked))
        x, y = rng.uniform(-35.0, 35.0, (2, self.n_points))
        noise_mm = rng.normal(0.0, 0.02, (self.n_points, 3))
        return self.true.apply(np.column_stack([x, y, height_mm(x, y)])) + noise_mm

    def _measurement(self, points_mm: np.ndarray, share: float) -> Measurement:
        self.answers.append(Measurement(NO_MAP, lambda: as_cloud(points_mm, 0.1), share, 11.0))
        return self.answers[-1]


class Listening:
    """A meter that notes which matchings it was asked for."""

    def __init__(self, meter, *names: str) -> None:
        self.meter, self.asked, self.given = meter, [], []
        self.names = names or ("measure_freely", "measure_on_model", "measure_on_samples")

    def __getattr__(self, name: str):
        if name in self.names:
            self.asked.append(name)
            return lambda *given: self.given.append(given) or getattr(self.meter, name)(*given)
        return getattr(self.meter, name)

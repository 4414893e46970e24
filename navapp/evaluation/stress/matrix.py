"""The tests of the stress matrix: every level of every axis, on some knees each."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from itertools import count, islice
from typing import Any

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.devices.simulated_room import find_cartilage_mm
from navapp.evaluation.methods import OURS
from navapp.evaluation.sequence import KnownSequence, render_room
from navapp.evaluation.stress.axes import AXES, Axis, find_seed, is_moving_fully
from navapp.evaluation.stress.changes import BONE
from navapp.geometry.transform import FloatArray

_STAGE = "opening"
_SEXES: tuple[Any, ...] = ("male", "female")


@dataclass(frozen=True, slots=True)
class StressTest:
    """One knee at one level of an axis."""

    axis_name: str
    level: float
    knee: int  # of the axis, from 0
    seed: int

    @property
    def name(self) -> str:
        """For files."""
        return f"{self.axis_name}-{self.level:g}-{self.knee}"

    @property
    def axis(self) -> Axis:
        """What is made worse."""
        return AXES[self.axis_name]

    def configure(self) -> Configuration:
        """The simulated camera before this knee, stepped."""
        values = {
            "seed": self.seed,
            "side": "left" if self.knee % 2 else "right",
            "sex": _SEXES[self.knee // 2 % 2],
            "stepped": True,
            **self.axis.settings(self.level),
        }
        simulated = SimulationSection(**values)
        return Configuration(camera=CameraSection(simulated=simulated, rate_hz=self.axis.rate_hz))

    def counts(self, index: int) -> bool:
        """The frame of that index shows what the level says; the first is registered in."""
        time_s = index / self.axis.rate_hz
        return index > 0 and is_moving_fully(self.axis, self.level, time_s)

    def render(self, n_frames: int) -> KnownSequence:
        """The pictures until so many have counted, with what the session is given."""
        last = next(islice((n for n in count() if self.counts(n)), n_frames - 1, None))
        sequence, thickness_mm = _render(self.configure(), last + 1)
        true_targets_mm = sequence.plan.targets_of(sequence.stage.targets)
        axis, rig, plan = self.axis, sequence.rig, sequence.plan
        if axis.rig is not None:
            rig = axis.rig(rig, self.level)
        if axis.plan is not None:
            plan = axis.plan(plan, self.level, thickness_mm)
        return replace(sequence, rig=rig, plan=plan, true_targets_mm=true_targets_mm)


@lru_cache(maxsize=1)
def _render(configuration: Configuration, n_frames: int) -> tuple[KnownSequence, FloatArray]:
    """Pictures, and the cartilage's thickness; kept, because levels of a rig or plan share them."""
    thickness_mm = find_cartilage_mm(configuration.camera.simulated, BONE)
    return render_room(configuration, _STAGE, n_frames), thickness_mm


@dataclass(frozen=True, slots=True)
class StressSettings:
    """What is run."""

    axes: tuple[str, ...]
    n_knees: int  # at each level
    n_frames: int  # that count, of each knee, after the one that is registered in
    first_seed: int
    is_quick: bool = False
    methods: tuple[str, ...] = (OURS,)

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        levels = {name: list(AXES[name].levels) for name in self.axes}
        return {
            "stress": levels,
            **{key: value for key, value in asdict(self).items() if key != "axes"},
            "methods": list(self.methods),
        }

    @property
    def tests(self) -> tuple[StressTest, ...]:
        """All of them; those with the same pictures stand beside each other."""
        return tuple(self._list_tests())

    @property
    def timed_tests(self) -> tuple[StressTest, ...]:
        """None: nothing is said of times."""
        return ()

    @property
    def has_details(self) -> bool:
        """False: its report shows neither worst frames nor error budgets."""
        return False

    def render(self, test: StressTest, n_frames: int | None = None) -> KnownSequence:
        """The pictures of a test until so many have counted."""
        return test.render(self.n_frames if n_frames is None else n_frames)

    def _list_tests(self) -> Iterator[StressTest]:
        for name in self.axes:
            axis = AXES[name]
            for knee in range(self.n_knees):
                seed = find_seed(axis, knee, self.first_seed)
                for level in axis.levels:
                    yield StressTest(name, level, knee, seed)

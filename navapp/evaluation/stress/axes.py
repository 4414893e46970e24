"""The axes of the stress matrix: what is made worse, by how much, and who can notice it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navapp.evaluation.stress import changes
from navapp.evaluation.stress.changes import PlanChange, RigChange

_PICTURES = "the judge, in the pictures"
_BOARD = "a board: `navapp calibrate check`, or held into a session's view"
_LENGTH = "a known length: a board whose squares were measured"
_CHECK = "the check on the patient"
_LATENCY = "`navapp calibrate latency`"
_STAMPS = "the time stamps of both pictures"

# px of blur in the exposure of 8 ms at 450 mm: the speed that makes it (docs/devices.md).
_MM_S_PER_BLUR_PX = 450.0 / (1403.0 * 0.008)
# A leg that is moved while the eyes see it at two times, or the rows at many.
_SLOW_DRIFT_MM_S, _DRIFT_RATE_HZ = 50.0, 30.0
# As of a thickness that is known vertex by vertex (docs/measurements.md).
_CARTILAGE_MM, _CARTILAGE_SD_MM = 2.0, 0.4


@dataclass(frozen=True, slots=True)
class Axis:
    """One thing that is made worse while all others stay as usual."""

    name: str  # for files and options
    title: str
    unit: str
    levels: tuple[float, ...]  # rising
    usual: float  # one of the levels
    # How a level changes what the simulated camera shows: keys of `[camera.simulated]`.
    settings: Callable[[float], Mapping[str, Any]] = lambda _: {}
    # How it changes what the session is given.
    rig: RigChange | None = None
    plan: PlanChange | None = None
    # Levels up to this far from the usual one leave no trace in the pictures: 0 of what a judge
    # can see, inf of what it never can.
    hidden_up_to: float = 0.0
    found_by: str = _PICTURES
    rate_hz: float = 15.0

    @property
    def is_cause(self) -> bool:
        """Pictures cannot show it, or not all of its levels."""
        return self.hidden_up_to > 0.0

    def is_hidden(self, level: float) -> bool:
        """Pictures cannot show this level."""
        return 0.0 < abs(level - self.usual) <= self.hidden_up_to

    def drift_mm_s(self, level: float) -> float:
        """How fast the leg is moved across the view."""
        return float(self.settings(level).get("drift_mm_s", 0.0))


@dataclass(frozen=True, slots=True)
class _Setting:
    """A key of the simulation that is the level, and others that go with it."""

    key: str
    also: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, level: float) -> Mapping[str, Any]:
        return {**self.also, self.key: level}


def _blur(name: str, title: str, also: Mapping[str, Any]) -> Axis:
    """The leg moves so fast that it is blurred by the level."""
    return Axis(
        name,
        f"motion blur{title}",
        "px",
        (0.0, 1.5, 3.0, 6.0),
        0.0,
        lambda px: {"blur": True, "drift_mm_s": round(_MM_S_PER_BLUR_PX * px, 1), **also},
        rate_hz=_DRIFT_RATE_HZ,
    )


_ROLLING, _SHAKING = {"shutter_ms": 15.0}, {"shake_mm": 0.3, "shake_hz": 8.0}
_DRIFTING = {"drift_mm_s": _SLOW_DRIFT_MM_S}

_PICTURE_AXES = (
    Axis("light", "light on the sensors", "times", (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0),
         1.0, _Setting("light")),
    Axis("noise", "noise: electrons of a full pixel", "e",
         (100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 20000.0), 20000.0, _Setting("full_well_e")),
    Axis("defocus", "defocus of both eyes", "px", (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0), 0.5,
         _Setting("defocus_px")),
    _blur("blur", "", {}),
    _blur("blur-shutter", ", shutter of 15 ms", _ROLLING),
    _blur("blur-shake", ", shake of 0.3 mm at 8 Hz", _SHAKING),
    _blur("blur-shutter-shake", ", shutter of 15 ms, shake of 0.3 mm at 8 Hz",
          {**_ROLLING, **_SHAKING}),
    Axis("shutter", "rolling shutter, leg moved at 50 mm/s", "ms",
         (0.0, 5.0, 10.0, 15.0, 20.0, 25.0), 0.0,
         _Setting("shutter_ms", {"blur": True, **_DRIFTING}), rate_hz=_DRIFT_RATE_HZ),
    Axis("shake", "shake of the arm at 8 Hz", "mm", (0.0, 0.3, 0.5, 1.0, 2.0, 5.0), 0.0,
         _Setting("shake_mm", {"blur": True})),
    Axis("highlights", "area of the wet highlights", "times",
         (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0), 1.0, _Setting("highlights")),
    Axis("contrast", "contrast of the bone's texture", "", (0.0, 0.01, 0.02, 0.03, 0.05, 0.1), 0.05,
         _Setting("contrast")),
    Axis("blood", "blood", "", (0.0, 0.3, 0.6, 1.0), 0.3, _Setting("blood")),
    Axis("covered", "share of the bone behind a cloth", "",
         (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8), 0.0, _Setting("covered")),
    Axis("distance", "distance", "mm", (300.0, 350.0, 450.0, 550.0, 650.0, 800.0), 450.0,
         _Setting("distance_mm")),
    Axis("baseline", "baseline, known", "mm", (20.0, 30.0, 60.0, 80.0, 120.0, 160.0, 240.0), 80.0,
         _Setting("baseline_mm")),
    Axis("skew", "time between the eyes that the stamps tell, leg moved at 50 mm/s", "ms",
         (0.0, 1.0, 2.0, 5.0, 10.0), 0.0, _Setting("skew_ms", _DRIFTING), found_by=_STAMPS,
         rate_hz=_DRIFT_RATE_HZ),
)  # fmt: skip

_CAUSES = (
    Axis("turn-sideways", "right camera turned sideways", "deg",
         (0.0, 0.003, 0.006, 0.0123, 0.03, 0.06), 0.0, rig=changes.change_turn(1),
         hidden_up_to=math.inf, found_by=_BOARD),
    Axis("baseline-length", "length of the baseline", "%", (0.0, 0.05, 0.1, 0.2, 0.5, 1.0), 0.0,
         rig=changes.change_baseline, hidden_up_to=math.inf, found_by=_LENGTH),
    Axis("time-offset", "time between the eyes that no stamp tells, leg moved at 50 mm/s", "ms",
         (0.0, 0.5, 1.0, 2.0, 5.0, 10.0), 0.0, _Setting("unstamped_skew_ms", _DRIFTING),
         hidden_up_to=math.inf, found_by=_LATENCY, rate_hz=_DRIFT_RATE_HZ),
    Axis("thickness", "cartilage of 2 mm, planned thicker (the plan claims a deviation of 0.4 mm)",
         "mm", (-1.2, -0.8, -0.4, -0.2, 0.0, 0.2, 0.4, 0.8, 1.2), 0.0,
         lambda _: {"cartilage_mm": _CARTILAGE_MM},
         plan=changes.misjudge_cartilage(_CARTILAGE_SD_MM), hidden_up_to=_CARTILAGE_SD_MM,
         found_by=_CHECK),
    Axis("scale", "scale of the plan", "%", (-5.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 5.0), 0.0,
         plan=changes.scale_plan, hidden_up_to=2.0, found_by=_CHECK),
    Axis("shift", "surface of the plan beside its targets", "mm", (0.0, 0.25, 0.5, 1.0, 2.0), 0.0,
         plan=changes.shift_plan, hidden_up_to=math.inf, found_by=_CHECK),
)  # fmt: skip

_PLAN_AXES = (
    Axis("growth", "surface of the plan outside the bone's", "mm",
         (-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0), 0.0, plan=changes.grow_plan),
    Axis("cartilage", "cartilage that the plan does not know", "mm",
         (0.0, 0.25, 0.5, 1.0, 1.5, 2.0), 0.0, _Setting("cartilage_mm")),
)  # fmt: skip

# Of each number of a camera: its unit, and levels that move points of the picture's outer parts by
# some tenths of a pixel to several pixels.
_NUMBERS = {
    "fx": ("%", (0.0, 0.05, 0.1, 0.2, 0.5, 1.0)),
    "fy": ("%", (0.0, 0.05, 0.1, 0.2, 0.5, 1.0)),
    "cx": ("px", (0.0, 0.1, 0.25, 0.5, 1.0, 2.0)),
    "cy": ("px", (0.0, 0.1, 0.25, 0.5, 1.0, 2.0)),
    "k1": ("", (0.0, 0.005, 0.02, 0.05, 0.2)),
    "k2": ("", (0.0, 0.05, 0.2, 0.5, 2.0)),
    "p1": ("", (0.0, 0.0005, 0.002, 0.005, 0.02)),
    "p2": ("", (0.0, 0.0005, 0.002, 0.005, 0.02)),
    "k3": ("", (0.0, 0.3, 3.0, 10.0, 30.0)),
}


# A principal point that is wrong along the rows shifts every disparity as a sideways turn does, and
# a focal length scales depth as the baseline does: no picture of one bone tells them from those.
_NOT_SEEN = ("fx", "cx")


def _camera_axes() -> tuple[Axis, ...]:
    return tuple(
        Axis(f"{eye}-{number}", f"{number} of the {eye} camera", unit, levels, 0.0,
             rig=changes.change_camera(eye, number), found_by=_BOARD,
             hidden_up_to=math.inf if number in _NOT_SEEN else 0.0)
        for number, (unit, levels) in _NUMBERS.items()
        for eye in changes.EYES
    )  # fmt: skip


_RIG_AXES = (
    Axis("focal", "focal lengths of both cameras", "%", (0.0, 0.05, 0.1, 0.2, 0.5, 1.0), 0.0,
         rig=changes.change_both_focal, found_by=_BOARD, hidden_up_to=math.inf),
    Axis("turn-upwards", "right camera turned up or down", "deg", (0.0, 0.003, 0.01, 0.02, 0.05),
         0.0, rig=changes.change_turn(0), found_by=_BOARD),
    Axis("roll", "right camera turned in its plane", "deg", (0.0, 0.01, 0.03, 0.1, 0.3), 0.0,
         rig=changes.change_turn(2), found_by=_BOARD),
    Axis("place-y", "right camera higher or lower", "mm", (0.0, 0.02, 0.05, 0.1, 0.2), 0.0,
         rig=changes.change_place(1), found_by=_BOARD),
    Axis("place-z", "right camera further back", "mm", (0.0, 0.3, 1.0, 2.0, 5.0), 0.0,
         rig=changes.change_place(2), found_by=_BOARD),
    *_camera_axes(),
)  # fmt: skip

# An axis keeps its knees as long as it keeps its place: new ones go to the
# end of their part, and every evaluation before that is of other knees.
AXES: dict[str, Axis] = {
    axis.name: axis for axis in (*_CAUSES, *_PICTURE_AXES, *_PLAN_AXES, *_RIG_AXES)
}
# First seed of the stress matrix, and how many seeds an axis has. No other test uses them, and no
# constant was set on them.
FIRST_STRESS_SEED, MOST_KNEES = 136_001, 100


def find_seed(axis: Axis, knee: int, first_seed: int) -> int:
    """Of a knee of an axis: the same at all levels, whatever else is run."""
    return first_seed + MOST_KNEES * list(AXES).index(axis.name) + knee


def is_moving_fully(axis: Axis, level: float, time_s: float) -> bool:
    """Nine tenths of the level's speed are reached: only there its blur is what the level says."""
    from sim_devices.drift import compute_drift_mm

    speed_mm_s = axis.drift_mm_s(level)
    if speed_mm_s == 0.0:
        return True
    step_s = 1e-3
    way_mm = np.diff([compute_drift_mm(speed_mm_s, time_s + sign * step_s) for sign in (-1, 1)])
    return bool(abs(way_mm[0]) > 0.9 * speed_mm_s * 2.0 * step_s)

"""Parameters of a simulated operation."""

from dataclasses import dataclass
from typing import Literal, get_args

from navapp.errors import UsageError
from sim_devices.anatomy import AgeGroup, KneeSpec, Sex, Side
from sim_devices.drift import HIGHEST_MM_S
from sim_devices.rigs import WORKING_DISTANCE_MM

MotionKind = Literal["still", "breathing", "patient", "jump"]
InstrumentKind = Literal["none", "sweep"]


_HIGHEST = {
    "cartilage_mm": 2.6, "contrast": 0.2, "blood": 1.0, "misses": 2.0,
    "drift_mm_s": HIGHEST_MM_S, "shake_mm": 5.0, "shake_hz": 50.0, "highlights": 32.0,
    "distance_mm": 1000.0,
}  # fmt: skip
# 0 of all others.
_LOWEST = {"distance_mm": 200.0}


@dataclass(frozen=True, slots=True)
class Scenario:
    """Patient, scene and what happens in it; the same values give the same pictures.

    Raises:
        UsageError: a value out of its bounds, or a knee, motion or instrument that there is not.
    """

    seed: int = 1  # of the anatomy, the textures, the tissue, the placement and the motion
    # side, sex, age_group: of the patient.
    side: Side = "right"
    sex: Sex = "female"
    age_group: AgeGroup = "middle"
    # mean thickness of the cartilage on the joint surfaces, 0 (bare bone) to 2.6; it is up to 3.2
    # in places.
    cartilage_mm: float = 0.0
    motion: MotionKind = "breathing"  # of the leg
    # "sweep" passes a hand with an instrument in front every six seconds.
    instrument: InstrumentKind = "none"
    stage: str = "opening"  # the surgical stage at the start
    # of the bone's texture (RMS of grey levels divided by their mean), 0.03 to 0.08.
    contrast: float = 0.05
    blood: float = 0.3  # 0 is dry, 1 is very bloody
    highlights: float = 1.0  # area of the wet highlights, times the usual one; 0 is matt, up to 32
    distance_mm: float = WORKING_DISTANCE_MM  # of the table from the rig, 200 to 1000
    # by how much saw and drill miss their plan: times 1 mm and 1.5 deg (standard deviations).
    misses: float = 1.0
    # the leg is moved to and fro across the view at this speed (`drift`), 0 to 300.
    drift_mm_s: float = 0.0
    # shake_mm, shake_hz: amplitude and frequency of the arm that carries the cameras (`shake`).
    shake_mm: float = 0.0
    shake_hz: float = 8.0

    def __post_init__(self) -> None:
        for name, highest in _HIGHEST.items():
            value, lowest = getattr(self, name), _LOWEST.get(name, 0.0)
            if not lowest <= value <= highest:
                remedy = f"use {lowest:g} to {highest}"
                raise UsageError(f"{name} is {value:g}", subject=name, remedy=remedy)
        for name, kind in (("motion", MotionKind), ("instrument", InstrumentKind)):
            value = getattr(self, name)
            if value not in get_args(kind):
                known = ", ".join(get_args(kind))
                raise UsageError(
                    f"there is no {name} {value!r}", subject=name, remedy=f"use one of {known}"
                )
        # The knee's own values are refused where a knee is specified.
        _ = self.knee

    @property
    def knee(self) -> KneeSpec:
        """The patient's knee."""
        return KneeSpec(self.seed, self.side, self.sex, self.age_group)

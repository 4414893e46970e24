"""What a simulated operation looks like."""

from dataclasses import dataclass
from typing import Literal

Side = Literal["left", "right"]
Sex = Literal["female", "male"]
AgeGroup = Literal["young", "middle", "old"]
MotionKind = Literal["still", "breathing", "patient", "jump"]
InstrumentKind = Literal["none", "sweep"]


@dataclass(frozen=True, slots=True)
class Scenario:
    """Patient, scene and what happens in it; the same values give the same pictures.

    Attributes:
        seed: of the anatomy, the textures, the tissue, the placement and the motion.
        side, sex, age_group: of the patient.
        cartilage_mm: mean thickness of the cartilage on the joint surfaces, 0 (bare bone) to 2.6;
            it is up to 3.2 in places.
        motion: of the leg.
        instrument: "sweep" passes a hand with an instrument in front every six seconds.
        stage: the surgical stage at the start.
        contrast: of the bone's texture (RMS of grey levels divided by their mean), 0.03 to 0.08.
        blood: 0 is dry, 1 is very bloody.

    Raises:
        ValueError: a value out of its bounds.
    """

    seed: int = 1
    side: Side = "right"
    sex: Sex = "female"
    age_group: AgeGroup = "middle"
    cartilage_mm: float = 0.0
    motion: MotionKind = "breathing"
    instrument: InstrumentKind = "none"
    stage: str = "opening"
    contrast: float = 0.05
    blood: float = 0.3

    def __post_init__(self) -> None:
        if self.side not in ("left", "right"):
            raise ValueError(f"the side of a knee is left or right, not {self.side!r}")
        if self.motion not in ("still", "breathing", "patient", "jump"):
            raise ValueError(f"there is no motion {self.motion!r}")
        if self.instrument not in ("none", "sweep"):
            raise ValueError(f"there is no instrument {self.instrument!r}")
        if not 0.0 <= self.cartilage_mm <= 2.6:
            raise ValueError("cartilage_mm must be 0 to 2.6")
        if not 0.0 <= self.contrast <= 0.2:
            raise ValueError("contrast must be 0 to 0.2")
        if not 0.0 <= self.blood <= 1.0:
            raise ValueError("blood must be 0 to 1")

"""How far guides in the mirror may appear from where they belong."""

from dataclasses import dataclass

# What guides may be off by for an eye that they are not drawn for.
OTHER_EYE_MM = 1.0


@dataclass(frozen=True, slots=True)
class MirrorError:
    """Of all guides that are drawn, at each guide's own place."""

    # 95 % of the errors stay below it wherever a guide is lit, seen with the viewing eye:
    # calibration, an eye beside its calibrated place, and pose.
    bound_mm: float
    covered_eye: str = ""  # the one that does not look; empty when both do
    # largest for the other eye, over all layers; None when it is covered.
    other_eye_mm: float | None = None
    # by so much away from the eye the screen's picture must move to stand amid the guides.
    screen_shift_mm: float = 0.0
    # layers that are not lit: off for the other eye by more than guides may be, or for the viewing
    # eye perhaps by more than the stage allows.
    off_layers: tuple[str, ...] = ()
    inexact_layers: tuple[str, ...] = ()
    is_dark: bool = False  # no layer is left

    @property
    def unlit_layers(self) -> tuple[str, ...]:
        """Both."""
        return tuple(dict.fromkeys((*self.off_layers, *self.inexact_layers)))

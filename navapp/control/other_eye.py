"""Guides in the mirror for the eye that they are not drawn for."""

from dataclasses import dataclass

# What guides may be off by for an eye that they are not drawn for.
OTHER_EYE_MM = 1.0


@dataclass(frozen=True, slots=True)
class OtherEye:
    """What guides at a bone are for the eye that they are not drawn for."""

    error_mm: float  # the largest
    screen_shift_mm: float  # by so much away from the eye the screen's picture must move

    @property
    def is_off(self) -> bool:
        """By more than guides may be."""
        return self.error_mm > OTHER_EYE_MM

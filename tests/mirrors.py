"""The display model that a simulated set-up truly is; no step of the line may be handed it."""

from navapp.devices.simulated_mirror import true_display

__all__ = ["true_display"]

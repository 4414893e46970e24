"""The projector of a set-up that has none to control."""

from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from navapp.errors import UnsupportedControl


class NoProjector:
    """Control line of an absent projector: refuses every command."""

    @property
    def name(self) -> str:
        """For people."""
        return "none"

    def open(self) -> None:
        """Nothing to connect."""

    def set_power(self, is_on: bool, timeout_s: float) -> CommandResult:
        """Refused."""
        raise _refusal("power")

    def set_source(self, source: str, timeout_s: float) -> CommandResult:
        """Refused."""
        raise _refusal("source")

    def set_mute(self, is_muted: bool, timeout_s: float) -> CommandResult:
        """Refused."""
        raise _refusal("mute")

    def set_flips(self, horizontally: bool, vertically: bool, timeout_s: float) -> CommandResult:
        """Refused."""
        raise _refusal("flips")

    def status(self) -> ProjectorStatus:
        """Absent, and nothing else is known."""
        return ProjectorStatus(PowerState.ABSENT)

    def close(self) -> None:
        """Nothing to disconnect."""


def _refusal(control: str) -> UnsupportedControl:
    return UnsupportedControl(
        f"no projector is configured, so its {control} cannot be set",
        subject="projector",
        remedy="set it on the device itself, or name its backend under [projector]",
    )

"""What the file of a display says of the display itself: its name, flips, projector and days."""

from dataclasses import dataclass, replace
from datetime import date, timedelta
from typing import TYPE_CHECKING

from navapp.errors import ConfigurationError, DeviceError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.geometry.display_model import DisplayModel

_NO_KEYSTONE = (0, 0)


@dataclass(frozen=True, slots=True)
class DisplayRecord:
    """The configured display as it is set while it is calibrated."""

    name: str  # by which the opened display is known
    backend_flips: tuple[bool, bool]  # horizontally and vertically
    mirror_deg: float  # of the mirror's mount
    valid_days: int  # of the calibration
    # projector_flips, keystone: read back from the projector; None where it does not say.
    projector_flips: tuple[bool, bool] | None = None
    keystone: tuple[int, int] | None = None

    def add_to(self, model: "DisplayModel") -> "DisplayModel":
        """The model with all that its file should say of the display."""
        assert model.quality is not None  # noqa: S101 (for the type checker: it always has one)
        today = date.today()
        return replace(
            model,
            display_name=self.name,
            backend_flips=self.backend_flips,
            mirror_deg=self.mirror_deg,
            projector_flips=self.projector_flips,
            keystone=self.keystone,
            quality=replace(
                model.quality, made_on=today, expires_on=today + timedelta(days=self.valid_days)
            ),
        )


def read_record(configuration: "Configuration") -> DisplayRecord:
    """Ask the configured display and projector.

    Raises:
        ConfigurationError: the display is configured to be flipped.
        DeviceError: a device does not answer; the projector is off, or bends the picture.
    """
    from drivers.interfaces import PowerState
    from navapp.devices import read_display_name, read_projector

    display = configuration.display
    if display.flip_horizontally or display.flip_vertically:
        raise ConfigurationError(
            "a display that is calibrated in the mirror is not flipped",
            subject="display.flip_horizontally, display.flip_vertically",
            remedy="set both to false and take the pictures again: the model knows its flips",
        )
    status = read_projector(configuration.projector)
    if status is not None and status.power is not PowerState.ON:
        raise DeviceError(
            f"the projector is not on ({status.power.value}): its flips and keystone are not told",
            subject="projector",
            remedy="switch it on, set as it is while the display is calibrated",
        )
    keystone = None if status is None else status.keystone
    if keystone not in (None, _NO_KEYSTONE):
        raise DeviceError(
            f"the projector bends the picture (keystone {keystone[0]}, {keystone[1]})",
            subject="projector",
            remedy="set its keystone to 0, and calibrate with the picture as it then is",
        )
    flips = None
    if status is not None and None not in (status.flips_horizontally, status.flips_vertically):
        flips = bool(status.flips_horizontally), bool(status.flips_vertically)
    return DisplayRecord(
        read_display_name(display),
        (display.flip_horizontally, display.flip_vertically),
        configuration.mirror.calibrated_deg,
        configuration.calibration.valid_days,
        flips,
        keystone,
    )

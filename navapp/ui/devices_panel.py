"""The devices panel: each device's health; those in trouble come first where space is short."""

from textual.content import Content

from navapp.control.states import DeviceHealth, DeviceLine
from navapp.ui.gauges import cut
from navapp.ui.text_view import TextView
from navapp.ui.view import View, choose_health_level

_TROUBLES = (DeviceHealth.LOST, DeviceHealth.TROUBLE)


class DevicesPanel(TextView):
    """A line a device, or two devices a line while nothing is wrong."""

    def __init__(self) -> None:
        super().__init__("devices")
        self.border_title = "devices"

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Fits any height; what does not fit is counted."""
        devices = sorted(view.snapshot.devices, key=lambda device: device.health not in _TROUBLES)
        if len(devices) <= height:
            return [format_device_line(view, device, width) for device in devices]
        troubles = [device for device in devices if device.health in _TROUBLES]
        if not troubles:
            if len(devices) > 2 * height:
                # What is not there gives way to what is.
                devices.sort(key=lambda device: device.health is DeviceHealth.ABSENT)
            return _in_pairs(view, devices[: 2 * height], width)
        shown = troubles[: max(height - 1, 1)]
        lines = [format_device_line(view, device, width) for device in shown]
        rest = len(devices) - len(shown)
        left = len(troubles) - len(shown)
        note = f"and {left} more in trouble" if left else f"{rest} others without trouble"
        return [*lines, Content.styled(cut(note, width, view.symbols), "$text-muted")]


def format_device_line(view: View, device: DeviceLine, width: int) -> Content:
    """Symbol, kind and health; name and detail as far as they fit."""
    level = choose_health_level(device.health)
    word = device.health.value
    shown = word.upper() if device.health in _TROUBLES else word
    head = f"{level.mark(view.symbols)} {cut(device.kind, 10, view.symbols):<10} {shown:<8}"
    more = cut(f"{device.name} {device.detail}", max(width - len(head), 0), view.symbols)
    return Content.assemble((head, level.value), (more, "$text-muted"))


def _in_pairs(view: View, devices: list[DeviceLine], width: int) -> list[Content]:
    half = width // 2
    cells = []
    for device in devices:
        level = choose_health_level(device.health)
        name = cut(device.kind, half - 3, view.symbols).ljust(half - 2)
        style = "$foreground" if device.health is DeviceHealth.OK else "$text-muted"
        cells.append(Content.assemble((f"{level.mark(view.symbols)} ", level.value), (name, style)))
    return [Content("").join(cells[i : i + 2]) for i in range(0, len(cells), 2)]

"""Finds video devices by serial number or USB port; device numbers change and are not used."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from navapp.errors import DeviceNotFound, UsageError

# A camera's second node (index1) carries descriptions of pictures, no pictures.
_PICTURES = "-video-index0"


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A connected camera."""

    path: Path  # a name of its device that stays when it is plugged in again
    node: Path  # the device behind it
    serial: str  # its serial number; of a camera without one, the name that the system made for it


@dataclass(frozen=True, slots=True)
class V4lNames:
    """The names that Linux gives to video devices."""

    links: Path = Path("/dev/v4l")  # folder with `by-id` and `by-path`
    sysfs: Path = Path("/sys/class/video4linux")  # folder with a folder for every video device
    devices: Path = Path("/dev")  # folder of the devices themselves

    def list_cameras(self) -> tuple[FoundCamera, ...]:
        """Every camera once, by its serial number where that names it alone."""
        by_node: dict[Path, FoundCamera] = {}
        for path in self._all_links():
            by_node.setdefault(path.resolve(), self._camera(path))
        return tuple(by_node.values())

    def find(self, wanted: str) -> FoundCamera:
        """The camera with a serial number, or at a path below `by-id` or `by-path`.

        Raises:
            DeviceNotFound: it is not connected, or two cameras have that number.
            UsageError: another path: the numbers of `/dev/videoN` change.
        """
        if "/" in wanted:
            return self._at(Path(wanted))
        cameras = self.list_cameras()
        found = [camera for camera in cameras if camera.serial == wanted]
        if not found:
            raise _absent(wanted, cameras)
        if len(found) > 1:
            raise DeviceNotFound(
                f"{len(found)} cameras have the serial number {wanted}",
                subject=wanted,
                remedy=f"name each by its port, a path below {self.links / 'by-path'}",
            )
        return found[0]

    def nodes(self) -> tuple[Path, ...]:
        """Devices that the kernel knows, with or without a lasting name; those of pictures only."""
        entries = self.sysfs.glob("video*") if self.sysfs.is_dir() else ()
        return tuple(
            self.devices / entry.name
            for entry in entries
            if _read_text(entry / "index") in ("", "0")
        )

    def card(self, node: Path) -> str:
        """A camera's name for people, as the kernel has it; empty when it has none."""
        return _read_text(self.sysfs / node.name / "name")

    def serial(self, node: Path) -> str:
        """As the camera tells it; empty when it has none."""
        interface = (self.sysfs / node.name / "device").resolve()
        return _read_text(interface.parent / "serial")

    def port(self, node: Path) -> Path | None:
        """The path of the port that a camera is plugged into."""
        for path in self._all_links():
            if path.parent.name == "by-path" and path.resolve() == node:
                return path
        return None

    def _at(self, path: Path) -> FoundCamera:
        if path.parent not in (self.links / "by-id", self.links / "by-path"):
            raise UsageError(
                f"{path} does not name a camera for good",
                subject=str(path),
                remedy=f"use its serial number, or a path below {self.links / 'by-id'}",
            )
        if not path.exists():
            raise _absent(str(path), self.list_cameras())
        return self._camera(path)

    def _all_links(self) -> Iterator[Path]:
        for folder in ("by-id", "by-path"):
            if (self.links / folder).is_dir():
                yield from sorted((self.links / folder).glob(f"*{_PICTURES}"))

    def _camera(self, path: Path) -> FoundCamera:
        node = path.resolve()
        return FoundCamera(path, node, self.serial(node) or path.name.removesuffix(_PICTURES))


def _read_text(file: Path) -> str:
    """Content of a small file of the kernel's; empty when it cannot be read."""
    try:
        return file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def _absent(wanted: str, cameras: tuple[FoundCamera, ...]) -> DeviceNotFound:
    seen = ", ".join(camera.serial for camera in cameras) or "none"
    return DeviceNotFound(
        f"camera {wanted} is not connected (connected: {seen})",
        subject=wanted,
        remedy="plug it in, or correct its name in the configuration",
    )

"""USB cameras as OpenCV's capture object shows them, with all that it hides."""

import shutil
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from drivers.v4l_names import V4lNames

MJPG = float(cv2.VideoWriter.fourcc(*"MJPG"))
ABSENT = -1.0
DEFAULTS = {
    cv2.CAP_PROP_MODE: 0.0,
    cv2.CAP_PROP_FOURCC: float(cv2.VideoWriter.fourcc(*"YUYV")),
    cv2.CAP_PROP_FRAME_WIDTH: 640.0,
    cv2.CAP_PROP_FRAME_HEIGHT: 480.0,
    cv2.CAP_PROP_FPS: 30.0,
    cv2.CAP_PROP_BUFFERSIZE: 4.0,
    cv2.CAP_PROP_EXPOSURE: 156.0,
    cv2.CAP_PROP_AUTO_EXPOSURE: 3.0,
    cv2.CAP_PROP_GAIN: 0.0,
    cv2.CAP_PROP_AUTO_WB: 1.0,
    cv2.CAP_PROP_WB_TEMPERATURE: 4600.0,
    cv2.CAP_PROP_AUTOFOCUS: 1.0,
    cv2.CAP_PROP_FOCUS: 30.0,
}


@dataclass
class FakeCamera:
    """A camera on the bus; tests change it while it runs.

    Attributes:
        offset_s: of its exposures against multiples of the period.
        stubborn: properties that stay where they are, though `set` returns True.
        steps: raw steps of a property; the camera takes the nearest.
        late_s: a picture's stamp is so much older than its arrival.
        stamps: of the host's clock, of its own, or none.
    """

    serial: str
    is_plugged: bool = True
    is_stalled: bool = False
    is_frozen: bool = False
    is_hanging: bool = False
    is_damaged: bool = False
    is_normalised: bool = False
    offset_s: float = 0.0
    late_s: float = 0.0
    stamps: str = "host"
    stall_s: float = 0.02
    stubborn: set[int] = field(default_factory=set)
    steps: dict[int, float] = field(default_factory=dict)
    absent: set[int] = field(default_factory=set)
    shape: tuple[int, int] | None = None
    captures: list["FakeCapture"] = field(default_factory=list)

    @property
    def n_open(self) -> int:
        return sum(capture.is_open for capture in self.captures)


class FakeCapture:
    """As `cv2.VideoCapture` on V4L2: `set` says yes, `isOpened` stays, an unplug fails at once."""

    def __init__(self, camera: FakeCamera) -> None:
        self.camera = camera
        self.is_open = camera.is_plugged and camera.n_open == 0
        self.props = {key: DEFAULTS[key] for key in DEFAULTS if key not in camera.absent}
        self.props[cv2.CAP_PROP_MODE] = float(camera.is_normalised)
        self.n_grabbed = 0
        self.stamp_s = 0.0
        self.released = threading.Event()
        self.asked: list[int] = []
        self.threads: set[int] = set()
        camera.captures.append(self)
        del camera.captures[:-3]

    def isOpened(self) -> bool:  # noqa: N802
        return self.is_open

    def set(self, propId: int, value: float, /) -> bool:
        self.asked.append(propId)
        if propId not in self.props:
            return False
        if propId not in self.camera.stubborn:
            step = self.camera.steps.get(propId)
            self.props[propId] = value if step is None else round(value / step) * step
        return True

    def get(self, propId: int, /) -> float:
        if propId == cv2.CAP_PROP_POS_MSEC:
            origin_s = {"host": 0.0, "own": 1e6, "none": None}[self.camera.stamps]
            return 0.0 if origin_s is None else (self.stamp_s + origin_s) * 1e3
        return self.props.get(propId, ABSENT)

    def grab(self) -> bool:
        self.threads.add(threading.get_ident())
        if self.camera.is_hanging:
            self.released.wait(30.0)
        if not self.camera.is_plugged:
            return False
        if self.camera.is_stalled:
            time.sleep(self.camera.stall_s)
            return False
        if self.camera.is_frozen:
            return True
        self._wait_for_exposure()
        self.n_grabbed += 1
        return True

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        if self.camera.is_damaged:
            return False, None
        height, width = self.camera.shape or (
            int(self.props[cv2.CAP_PROP_FRAME_HEIGHT]),
            int(self.props[cv2.CAP_PROP_FRAME_WIDTH]),
        )
        picture = np.full((height, width, 3), self.n_grabbed % 200, np.uint8)
        picture[:, width // 2 :] += 50
        return True, picture

    def release(self) -> None:
        self.is_open = False
        self.released.set()

    def _wait_for_exposure(self) -> None:
        period_s = 1.0 / self.props[cv2.CAP_PROP_FPS]
        now_s = time.monotonic()
        n = int((now_s - self.camera.offset_s) / period_s) + 1
        due_s = n * period_s + self.camera.offset_s
        time.sleep(max(0.0, due_s - now_s))
        # A picture arrives when its exposure has ended; the stamp is of its start.
        exposure_s = self.props.get(cv2.CAP_PROP_EXPOSURE, 0.0) * 1e-4
        self.stamp_s = due_s - exposure_s - self.camera.late_s


class FilmedCapture(FakeCapture):
    """Its pictures are decoded by OpenCV's own capture from a video file; it ends with the file."""

    def __init__(self, camera: FakeCamera, film: Path) -> None:
        super().__init__(camera)
        self.film = cv2.VideoCapture(str(film), cv2.CAP_FFMPEG)
        assert self.film.isOpened()

    def grab(self) -> bool:
        return super().grab() and self.film.grab()

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        return self.film.retrieve()

    def release(self) -> None:
        super().release()
        self.film.release()


class FakeBus:
    """Folders as udev and sysfs make them, and an opener of what is plugged in."""

    def __init__(self, root: Path) -> None:
        self.names = V4lNames(root / "v4l", root / "sysfs", root / "dev")
        self.root = root
        self.cameras: dict[Path, FakeCamera] = {}
        self.films: dict[Path, Path] = {}
        for folder in (root / "v4l" / "by-id", root / "v4l" / "by-path", root / "dev"):
            folder.mkdir(parents=True, exist_ok=True)

    def plug(self, serial: str, port: int, told: str | None = None) -> FakeCamera:
        """Connect a camera with that serial number; `told` is what sysfs has of it."""
        node = self.root / "dev" / f"video{2 * port}"
        node.touch()
        interface = self.root / "devices" / f"usb{port}" / "interface"
        interface.mkdir(parents=True, exist_ok=True)
        serial_file = interface.parent / "serial"
        if told == "":
            serial_file.unlink(missing_ok=True)
        else:
            serial_file.write_text(f"{told or serial}\n")
        entry = self.root / "sysfs" / node.name
        entry.mkdir(parents=True, exist_ok=True)
        _link(entry / "device", interface)
        (entry / "index").write_text("0\n")
        (entry / "name").write_text(f"Acme Cam {port}\n")
        links = self.names.links
        _link(links / "by-id" / f"usb-Acme_Cam_{serial}-video-index0", node)
        _link(links / "by-path" / f"pci-0-usb-0:{port}-video-index0", node)
        _link(links / "by-path" / f"pci-0-usbv2-0:{port}-video-index0", node)
        self.cameras[node] = FakeCamera(serial)
        return self.cameras[node]

    def unplug(self, camera: FakeCamera) -> None:
        """Take it off the bus: its names vanish, its captures fail."""
        camera.is_plugged = False
        node = next(node for node, one in self.cameras.items() if one is camera)
        for link in self.names.links.glob("by-*/*"):
            if link.resolve() == node:
                link.unlink()
        shutil.rmtree(self.root / "sysfs" / node.name)
        del self.cameras[node]
        node.unlink()

    def open_capture(self, path: str) -> FakeCapture:
        node = Path(path).resolve()
        if node in self.films:
            return FilmedCapture(self.cameras[node], self.films[node])
        return FakeCapture(self.cameras.get(node) or FakeCamera("", is_plugged=False))


def _link(link: Path, target: Path) -> None:
    link.unlink(missing_ok=True)
    link.symlink_to(target)

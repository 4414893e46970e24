"""The contract of a stereo camera."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from drivers.clock import Clock
from drivers.contracts.violation import (
    ContractViolation,
    must_leave_nothing,
    must_return_soon,
    must_work,
    open_subject,
    require,
    require_raises,
)
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from drivers.latest import LatestSlot, ReaderThread
from navapp.errors import DeviceLost, DeviceTimeout, UnsupportedControl


@dataclass(frozen=True, slots=True)
class CameraUnderTest:
    """A camera that was never opened, and what must be known to test it."""

    camera: StereoCamera  # fresh; the checks open and close it
    clock: Clock  # the one that its time stamps are from
    # name of a control and a value that it must accept; None when it has no control.
    control: tuple[str, float] | None = None
    n_frames: int = 4  # how many frames can be read at least, 3 or more
    timeout_s: float = 2.0  # within which a frame comes when all goes well


MakeCamera = Callable[[], CameraUnderTest]


def check_opening_twice(make: MakeCamera) -> None:
    """Opening an open camera changes nothing."""
    with _open_subject(make) as subject:
        first = _read(subject)
        with must_work("opening an open camera"):
            subject.camera.open()
        second = _read(subject)
        require(second.sequence > first.sequence, "opening an open camera started it again")


def check_closing_in_any_state(make: MakeCamera) -> None:
    """Closing works before opening, twice, and twice after reading; then the camera is closed."""
    for n_frames in (None, 0, 1):
        subject = make()
        if n_frames is not None:
            subject.camera.open()
        for _ in range(n_frames or 0):
            _read(subject)
        with must_work("closing a camera"), must_return_soon("closing a camera", 5.0):
            subject.camera.close()
            subject.camera.close()
        read = partial(subject.camera.read, subject.timeout_s)
        require_raises(DeviceLost, read, "reading a camera that was closed twice")


def check_reading_when_not_open(make: MakeCamera) -> None:
    """Reading a camera that is not open, or no longer, says that it is lost."""
    subject = make()
    camera, timeout_s = subject.camera, subject.timeout_s
    require_raises(DeviceLost, lambda: camera.read(timeout_s), "reading before opening")
    camera.open()
    camera.close()
    require_raises(DeviceLost, lambda: camera.read(timeout_s), "reading after closing")


def check_order_of_frames(make: MakeCamera) -> None:
    """Sequence and capture time increase strictly; nothing is received before its capture."""
    with _open_subject(make) as subject:
        frames = [_read(subject) for _ in range(subject.n_frames)]
        now_ns = subject.clock.now_ns()
    for earlier, later in pairwise(frames):
        require(later.sequence > earlier.sequence, "sequence must increase strictly")
        require(later.captured_ns > earlier.captured_ns, "capture times must increase strictly")
    for frame in frames:
        require(frame.received_ns >= frame.captured_ns, "a frame was received before its capture")
        require(frame.received_ns <= now_ns, "a frame was received in the future")


def check_pictures(make: MakeCamera) -> None:
    """Pictures are uint8, of the size that `info` tells, and all of one shape."""
    with _open_subject(make) as subject:
        info = subject.camera.info
        frames = [_read(subject) for _ in range(3)]
    for frame in frames:
        for picture in (frame.left, frame.right):
            require(picture.dtype == np.uint8, f"pictures must be uint8, not {picture.dtype}")
            require(
                picture.shape[:2] == (info.height, info.width),
                f"a picture is {picture.shape[1]}x{picture.shape[0]}, but info tells "
                f"{info.width}x{info.height}",
            )
            require(picture.shape == frames[0].left.shape, "pictures must all have one shape")


def check_pictures_are_kept(make: MakeCamera) -> None:
    """A picture that was handed out is not written again by later frames, nor by closing."""
    with _open_subject(make) as subject:
        frame = _read(subject)
        left, right = frame.left.copy(), frame.right.copy()
        for _ in range(2):
            _read(subject)
    is_kept = np.array_equal(left, frame.left) and np.array_equal(right, frame.right)
    require(is_kept, "a picture changed after it was handed out")


def check_short_timeouts(make: MakeCamera) -> None:
    """With a short timeout `read` returns a frame or `DeviceTimeout`, soon, and goes on to work."""
    with _open_subject(make) as subject:
        for timeout_s in (0.0, 0.001):
            with must_return_soon(f"reading with a timeout of {timeout_s} s", timeout_s):
                try:
                    subject.camera.read(timeout_s)
                except DeviceTimeout:
                    pass
                except Exception as error:
                    raise ContractViolation(
                        f"reading with a short timeout raised {error!r}"
                    ) from error
        _read(subject)


def check_reopening(make: MakeCamera) -> None:
    """A closed camera can be opened again and gives frames."""
    with _open_subject(make) as subject:
        _read(subject)
        subject.camera.close()
        with must_work("opening a closed camera again"):
            subject.camera.open()
        _read(subject)


def check_info(make: MakeCamera) -> None:
    """`info` never fails, is complete when open, and tells the measured rate after some frames."""
    subject = make()
    with must_work("asking a closed camera for its info"):
        name = subject.camera.info.name
    subject.camera.open()
    try:
        info = subject.camera.info
        require(info.name == name, "the name must not change by opening")
        require(bool(info.name) and bool(info.backend), "name and backend must not be empty")
        require(info.width > 0 and info.height > 0, "an open camera must know its picture size")
        is_marked = info.name.startswith("sim:")
        require(is_marked == info.is_simulated, "a simulated camera's name begins with sim:")
        for _ in range(3):
            _read(subject)
        rate_hz = subject.camera.info.measured_rate_hz
        require(rate_hz is not None and rate_hz > 0.0, "measured_rate_hz is missing after 3 frames")
    finally:
        subject.camera.close()


def check_unknown_control(make: MakeCamera) -> None:
    """An unknown control is refused, and so is a value that cannot be meant."""
    with _open_subject(make) as subject:
        camera = subject.camera
        require_raises(UnsupportedControl, lambda: camera.set("no such control", 1.0), "that name")
        if subject.control is not None:
            name = subject.control[0]
            for value in (float("nan"), -1e12, 1e12):
                require_raises(
                    UnsupportedControl,
                    partial(camera.set, name, value),
                    f"setting {name} to {value}",
                )


def check_control_is_read_back(make: MakeCamera) -> None:
    """`set` returns what the camera has, and setting just that changes nothing more."""
    with _open_subject(make) as subject:
        if subject.control is None:
            return
        name, value = subject.control
        with must_work(f"setting {name} to {value}"):
            accepted = subject.camera.set(name, value)
            again = subject.camera.set(name, accepted)
        require(again == accepted, f"{name} set to {accepted} as read back became {again}")
        nearness = 0.1 * abs(value) + 1e-9
        require(abs(accepted - value) <= nearness, f"{name} {value} came back as {accepted}")
        _read(subject)


def check_nothing_is_left(make: MakeCamera) -> None:
    """After closing no thread and no file descriptor remains."""
    for is_counted in (False, True):  # libraries may open something for good the first time
        if not is_counted:
            _open_read_close(make())
            continue
        subject = make()
        with must_leave_nothing("the camera"):
            _open_read_close(subject)


def check_reader_thread(make: MakeCamera) -> None:
    """A free-running camera works in a `ReaderThread`, which can be stopped at any time."""
    subject = make()
    subject.camera.open()
    if subject.camera.info.is_stepped:
        subject.camera.close()
        return
    slot: LatestSlot[StereoFrame] = LatestSlot()
    reader = ReaderThread(subject.camera, slot, timeout_s=subject.timeout_s)
    reader.start()
    try:
        frames = [slot.take(subject.timeout_s + 2.0) for _ in range(2)]
    finally:
        is_stopped = reader.stop()
    require(is_stopped, "the reader thread could not be stopped: a read blocks without bound")
    require(None not in frames, "no frame came through the reader thread")
    camera = subject.camera
    require_raises(DeviceLost, lambda: camera.read(0.1), "reading after the reader has closed it")


CAMERA_CHECKS: tuple[Callable[[MakeCamera], None], ...] = (
    check_opening_twice,
    check_closing_in_any_state,
    check_reading_when_not_open,
    check_order_of_frames,
    check_pictures,
    check_pictures_are_kept,
    check_short_timeouts,
    check_reopening,
    check_info,
    check_unknown_control,
    check_control_is_read_back,
    check_nothing_is_left,
    check_reader_thread,
)


def _open_subject(make: MakeCamera) -> AbstractContextManager[CameraUnderTest]:
    return open_subject(make, lambda subject: subject.camera, "a camera")


def _read(subject: CameraUnderTest) -> StereoFrame:
    with must_return_soon("reading a frame", subject.timeout_s):
        try:
            return subject.camera.read(subject.timeout_s)
        except Exception as error:
            raise ContractViolation(f"reading a frame raised {error!r}") from error


def _open_read_close(subject: CameraUnderTest) -> None:
    subject.camera.open()
    try:
        _read(subject)
    finally:
        subject.camera.close()

"""Records with a camera the code that a display shows."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.latency.display_area import WatchedCells
from calibration.latency.light_code import Switches
from drivers.clock import Clock
from drivers.frames import Image, StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.display_delay.code_player import CodePlayer
from navapp.errors import DeviceTimeout
from navapp.geometry.rectification import luma

# Cells across and down; a display as large as one of them is seen.
_CELLS = (32, 18)
# The first frames of a camera that settles; they tell its period, too.
_N_FIRST = 5
# So long after the last switch it may still be seen.
_TAIL_NS = 700_000_000
_TIMEOUT_S, _LONGEST_SILENCE_NS = 0.5, 5_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class CodeRecording:
    """What was shown and what was seen, ms since the first switch."""

    switches: Switches  # of the display
    # left, right: of the same pairs.
    left: WatchedCells
    right: WatchedCells
    age_ms: float | None  # from capture to receipt, median; None of a camera that waits to be read


class _Frames:
    """New frames of a camera, and what is kept of them."""

    def __init__(self, camera: StereoCamera, clock: Clock) -> None:
        self._camera, self._clock = camera, clock
        self._captured_ns: list[int] = []
        self._skew_ns: list[int] = []
        self._age_ns: list[int] = []
        self._cells: tuple[list[NDArray[np.float32]], ...] = ([], [])

    @property
    def last_ns(self) -> int:
        return self._captured_ns[-1]

    @property
    def period_ns(self) -> int:
        """The shortest so far."""
        return int(np.diff(self._captured_ns).min())

    def read(self) -> None:
        """One more.

        Raises:
            DeviceTimeout: none came for five seconds; DeviceLost.
        """
        frame = self._new_frame()
        self._captured_ns.append(frame.captured_ns)
        self._skew_ns.append(frame.skew_ns)
        self._age_ns.append(frame.received_ns - frame.captured_ns)
        for cells, picture in zip(self._cells, (frame.left, frame.right), strict=True):
            cells.append(_means(picture))

    def as_watched(self, since_ns: int) -> tuple[WatchedCells, WatchedCells]:
        """Both eyes, in time since then."""
        left_ms = 1e-6 * np.array([time_ns - since_ns for time_ns in self._captured_ns])
        right_ms = left_ms + 1e-6 * np.array(self._skew_ns)
        left, right = (np.array(cells) for cells in self._cells)
        return WatchedCells(np.asarray(left_ms), left), WatchedCells(np.asarray(right_ms), right)

    @property
    def age_ms(self) -> float | None:
        if self._camera.info.is_stepped:
            return None
        return float(np.median(self._age_ns)) * 1e-6

    def _new_frame(self) -> StereoFrame:
        patient_until_ns = self._clock.now_ns() + _LONGEST_SILENCE_NS
        while self._clock.now_ns() < patient_until_ns:
            try:
                frame = self._camera.read(_TIMEOUT_S)
            except DeviceTimeout:
                continue
            if not self._captured_ns or frame.captured_ns > self.last_ns:
                return frame
        raise DeviceTimeout(
            f"camera {self._camera.info.name} gave no new frame for "
            f"{_LONGEST_SILENCE_NS / 1e9:.0f} s",
            subject=self._camera.info.name,
            remedy="see that it runs with `navapp run`, and measure again",
        )


def record_code(
    camera: StereoCamera, player: CodePlayer, clock: Clock, on_progress: Callable[[float], None]
) -> CodeRecording:
    """Play the code and read the camera until its end has been seen; the display is dark then.

    A camera that runs by itself is read here while a thread plays. One that waits to be read is
    stepped past every switch in turn, so that nothing depends on the computer's speed.

    Args:
        camera: opened.
        player: of a display that the camera sees.
        clock: of both.
        on_progress: is told the share done.

    Raises:
        DeviceError: camera or display failed.
    """
    frames = _Frames(camera, clock)
    for _ in range(_N_FIRST):
        frames.read()
    with _CodePlayback(player, in_thread=not camera.info.is_stepped) as playing:
        while not player.is_over or frames.last_ns < player.called_ns[-1] + _TAIL_NS:
            playing.go_on(frames.last_ns + 2 * frames.period_ns)
            frames.read()
            on_progress(min(len(player.called_ns) / player.n_switches, 0.99))
    on_progress(1.0)
    left, right = frames.as_watched(player.called_ns[0])
    return CodeRecording(player.switches, left, right, frames.age_ms)


class _CodePlayback:
    """Plays the code in a thread or step by step; the display is dark at the end."""

    def __init__(self, player: CodePlayer, *, in_thread: bool) -> None:
        self._player = player
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="code") if in_thread else None

    def __enter__(self) -> "_CodePlayback":
        self._player.begin()
        if self._thread is not None:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._player.stop()
        if self._thread is not None:
            self._thread.join()
        self._player.darken()

    def go_on(self, until_ns: int) -> None:
        """Step until then; what failed in the thread is raised here."""
        if self._thread is None:
            self._player.play(until_ns)
        elif self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            self._player.play()
        except Exception as error:  # noqa: BLE001 (raised again where the camera is read)
            self._error = error


def _means(picture: Image) -> NDArray[np.float32]:
    """(c,) mean grey value of every cell."""
    small = cv2.resize(luma(picture), _CELLS, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32).ravel()

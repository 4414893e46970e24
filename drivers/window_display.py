"""A window in a process of its own: it covers one output, or lies framed on the desktop.

Dark without the application's help: when a picture expires, when the application hangs or is gone.
"""

import contextlib
import time
from dataclasses import replace

import cv2
import numpy as np

from drivers.clock import Clock
from drivers.frames import Image
from drivers.interfaces import DisplayInfo
from drivers.window_memory import Field
from drivers.window_process import WindowProcess, WindowSettings
from navapp.errors import DeviceLost

# (flips_horizontally, flips_vertically) -> cv2.flip's code
_FLIP_CODES = {(True, False): 1, (False, True): 0, (True, True): -1}


class WindowDisplay:
    """Full-screen borderless window, pixel for pixel; or a framed one that scales.

    Expiries are times of the given clock; how far away they are is measured on the host's, so a
    clock that stands does not keep a picture alive.
    """

    def __init__(self, clock: Clock, settings: WindowSettings) -> None:
        self._clock = clock
        self._settings = settings
        self._info = DisplayInfo(
            settings.output or "window",
            "window on the desktop" if settings.is_framed else "window",
            False,
            settings.width,
            settings.height,
            settings.flips_horizontally,
            settings.flips_vertically,
        )
        self._process: WindowProcess | None = None

    @property
    def info(self) -> DisplayInfo:
        """Identity, size and the flips; since it was opened first, its output's real name."""
        return self._info

    @property
    def process(self) -> WindowProcess | None:
        """The window's process while it is open."""
        return self._process

    def open(self) -> None:
        """Start black; nothing happens when open, a window that was lost is opened anew.

        Raises:
            DeviceNotFound: no X11 screen, no such output.
            WrongDevice: the output has another size.
            DeviceTimeout, DeviceLost, DeviceError: the window could not be opened.
        """
        if self._process is not None and not self._process.is_alive:
            self.close()
        if self._process is None:
            self._process = WindowProcess(self._settings)
            self._info = replace(self._info, name=self._process.output or self._info.name)

    def show(self, image: Image, valid_until_ns: int) -> None:
        """Show a picture until that moment; one that is expired already changes nothing."""
        info = self._info
        shape = (info.height, info.width, 3)
        if image.shape != shape or image.dtype != np.uint8:
            raise ValueError(f"the display takes uint8 pictures of shape {shape}")
        process = self._process
        if process is None or not process.is_alive:
            raise DeviceLost(
                "the display's window is not open" if process is None else "the window is gone",
                subject=info.name,
                remedy="open it before showing pictures",
            )
        # The host's clock first: what passes between the two makes the picture end early, not late.
        host_ns = time.monotonic_ns()
        left_ns = valid_until_ns - self._clock.now_ns()
        if left_ns > 0:
            self._write(process, image, host_ns + left_ns)

    def blank(self) -> None:
        """Black, now; what is being shown by another thread is withdrawn, too."""
        process = self._process
        if process is None:
            return
        # Closed by another thread at this moment: it is black then.
        with contextlib.suppress(ValueError):
            fields = process.memory.fields
            fields[Field.WITHDRAWN] = fields[Field.WRITING]
            process.wake()

    def close(self) -> None:
        """Black and closed."""
        process, self._process = self._process, None
        if process is not None:
            process.close()

    def _write(self, process: WindowProcess, image: Image, valid_until_ns: int) -> None:
        info, fields = self._info, process.memory.fields
        number = fields[Field.PUBLISHED] + 1
        fields[Field.WRITING] = number
        code = _FLIP_CODES.get((info.flips_horizontally, info.flips_vertically))
        seen = np.ascontiguousarray(image) if code is None else cv2.flip(image, code)
        place = np.frombuffer(process.memory.pictures[number % 2], np.uint8)
        cv2.cvtColor(seen, cv2.COLOR_BGR2BGRA, dst=place.reshape(info.height, info.width, 4))
        fields[Field.VALID_UNTIL_NS + number % 2] = valid_until_ns
        fields[Field.PUBLISHED] = number
        process.wake()

"""The process that owns the window; shows black unless the application confirms the picture.

Started by `drivers.window_display` as `python -m drivers.window_child MEMORY WAKE OUTPUT WIDTH
HEIGHT [framed]`: the descriptor of the shared memory, that of a pipe of which every byte means
"look again" and whose end means that the application is gone, the output wanted, the size of the
pictures, and whether the window has a frame: it can then be moved, resized and closed. It says in
one line of JSON on its standard output that the window stands, or why not.
"""

import json
import os
import select
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import closing

from drivers.window_memory import BEAT_S, HANG_LIMIT_NS, Field, WindowMemory, count_memory_bytes
from drivers.window_outputs import Output, choose_output, list_outputs, start_sdl
from navapp.errors import DeviceError

# What X11 takes for a window manager to put the window where it belongs.
_PLACING_S = 2.0
# Of a framed window: how much of the desktop it takes at most, and its title.
_ROOM = 0.9
_CAPTION = "navapp: what the display shows (research, not for clinical use)"


class Window:
    """A borderless window that covers an output, black at first.

    Raises:
        DeviceNotFound: no visible screen, no such output. WrongDevice: another size.
        DeviceError: the window does not cover the output pixel for pixel.
    """

    def __init__(self, output_name: str, width: int, height: int) -> None:
        # The operator's keys go to the terminal, not to the overlay.
        os.environ.setdefault("SDL_WINDOW_NO_ACTIVATION_WHEN_SHOWN", "1")
        self._pygame = pygame = start_sdl()
        self.output: Output = choose_output(list_outputs(), output_name, width, height)
        self._screen = pygame.display.set_mode(
            (width, height), pygame.NOFRAME, 32, display=self.output.index
        )
        pygame.mouse.set_visible(False)
        self.draw(None)
        self._check_pixels(width, height)
        self._wait_until_placed()

    def draw(self, pixels: memoryview | None) -> None:
        """Prepare these pixels, or black; `flip` makes them visible."""
        if pixels is None:
            self._screen.fill((0, 0, 0))
        else:
            memoryview(self._screen.get_view("0"))[:] = pixels

    def flip(self) -> None:
        """Show what was drawn."""
        self._pygame.display.flip()

    def was_disturbed(self) -> bool:
        """Whether a part of the window was lost, so that it must be shown again."""
        game = self._pygame
        losses = (game.VIDEOEXPOSE, game.WINDOWEXPOSED, game.WINDOWSHOWN, game.WINDOWRESTORED)
        return any(event.type in losses for event in game.event.get())

    def is_in_place(self) -> bool:
        """Whether it covers its output."""
        position = self._pygame.display.get_window_position()
        size = self._pygame.display.get_window_size()
        output = self.output
        return (*position, *size) == (output.left, output.top, output.width, output.height)

    def close(self) -> None:
        """Black, then gone when this returns."""
        self.draw(None)
        self.flip()
        self._pygame.display.quit()

    def _check_pixels(self, width: int, height: int) -> None:
        screen = self._screen
        layout = (screen.get_size(), screen.get_pitch(), screen.get_masks()[:3])
        if layout != ((width, height), 4 * width, (0xFF0000, 0xFF00, 0xFF)):
            raise DeviceError(
                f"output {self.output} does not take pixels one to one",
                subject=self.output.name,
                remedy="use a screen of 24 bits a pixel, without scaling",
            )

    def _wait_until_placed(self) -> None:
        end_s = time.monotonic() + _PLACING_S
        while True:
            self.was_disturbed()
            self.flip()
            if self.is_in_place():
                return
            if time.monotonic() > end_s:
                raise DeviceError(
                    f"the window manager does not let the window cover output {self.output}",
                    subject=self.output.name,
                    remedy="exempt it from tiling and panels, or run without a window manager",
                )
            time.sleep(0.01)


class FramedWindow:
    """A window of the desktop with a frame; pictures are scaled to it, black beside them.

    Raises:
        DeviceNotFound: no visible screen.
    """

    def __init__(self, width: int, height: int) -> None:
        # The operator's keys go to the terminal.
        os.environ.setdefault("SDL_WINDOW_NO_ACTIVATION_WHEN_SHOWN", "1")
        self._pygame = pygame = start_sdl()
        self._size = width, height
        self.output: Output = list_outputs()[0]
        room = _ROOM * self.output.width, _ROOM * self.output.height
        scale = min(1.0, room[0] / width, room[1] / height)
        window = round(scale * width), round(scale * height)
        self._screen = pygame.display.set_mode(window, pygame.RESIZABLE, 32)
        pygame.display.set_caption(_CAPTION)
        self._is_closed = False
        self.draw(None)
        self.flip()

    def draw(self, pixels: memoryview | None) -> None:
        """Prepare these pixels, or black; `flip` makes them visible."""
        self._screen = self._pygame.display.get_surface()
        self._screen.fill((0, 0, 0))
        if pixels is None:
            return
        picture = self._pygame.image.frombuffer(pixels, self._size, "BGRA")
        width, height = self._screen.get_size()
        scale = min(width / self._size[0], height / self._size[1])
        size = max(1, round(scale * self._size[0])), max(1, round(scale * self._size[1]))
        if size != self._size:
            picture = self._pygame.transform.smoothscale(picture, size)
        self._screen.blit(picture, ((width - size[0]) // 2, (height - size[1]) // 2))

    def flip(self) -> None:
        """Show what was drawn."""
        self._pygame.display.flip()

    def was_disturbed(self) -> bool:
        """Whether it must be shown again: a part was lost, or it has another size."""
        game, is_disturbed = self._pygame, False
        losses = (game.VIDEOEXPOSE, game.WINDOWEXPOSED, game.WINDOWSHOWN, game.WINDOWRESTORED)
        for event in game.event.get():
            self._is_closed |= event.type in (game.QUIT, game.WINDOWCLOSE)
            is_disturbed |= event.type in (*losses, game.VIDEORESIZE, game.WINDOWRESIZED)
        return is_disturbed

    def is_in_place(self) -> bool:
        """Whether it is there: its frame has a button that closes it."""
        return not self._is_closed

    def close(self) -> None:
        """Gone when this returns."""
        self._pygame.display.quit()


class Keeper:
    """Decides which picture the window shows, and waits for changes."""

    def __init__(self, window: "Window | FramedWindow", memory: WindowMemory, wake: int) -> None:
        self._window = window
        self._memory = memory
        self._wake = wake
        self._parent = os.getppid()
        self._seen = 0
        self._forfeited = 0

    def run(self) -> None:
        """Until the application closes the window, is gone, or the window is not in its place."""
        fields = self._memory.fields
        while not fields[Field.QUIT] and os.getppid() == self._parent:
            fields[Field.WINDOW_BEAT_NS] = time.monotonic_ns()
            is_disturbed = self._window.was_disturbed()
            if not self._window.is_in_place():
                return
            wanted = self._select_picture()
            if (is_disturbed or wanted != self._seen) and not self._show(wanted):
                continue
            if not self._wait():
                return

    def _select_picture(self) -> int:
        fields, now_ns = self._memory.fields, time.monotonic_ns()
        picture = fields[Field.PUBLISHED]
        if now_ns - fields[Field.APPLICATION_BEAT_NS] > HANG_LIMIT_NS:
            # An application that wakes up again must show where the bone is now.
            self._forfeited = picture
        if picture <= max(fields[Field.WITHDRAWN], self._forfeited):
            return 0
        return picture if now_ns < self._memory.valid_until_ns(picture) else 0

    def _show(self, picture: int) -> bool:
        """Make it visible; False when it must not be seen any more, or was replaced meanwhile.

        Its place is written again only after the picture between has been published.
        """
        self._window.draw(self._memory.pictures[picture % 2] if picture else None)
        if picture and self._select_picture() != picture:
            return False
        self._window.flip()
        self._seen = self._memory.fields[Field.SEEN] = picture
        return True

    def _wait(self) -> bool:
        """Until it is woken, the picture expires or it is time for a beat; False: all alone."""
        patience_s = BEAT_S
        if self._seen:
            left_ns = self._memory.valid_until_ns(self._seen) - time.monotonic_ns()
            patience_s = min(patience_s, max(0.0, left_ns / 1e9))
        ready, _, _ = select.select([self._wake], [], [], patience_s)
        return not ready or bool(os.read(self._wake, 4096))


def main(arguments: Sequence[str]) -> None:
    """Open the window, tell the application, keep the window, close it."""
    # Ctrl-C goes to every process of the terminal; it is for the application to end in order.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    memory_descriptor, wake, width, height = (int(arguments[k]) for k in (0, 1, 3, 4))
    try:
        is_framed = arguments[5:] == ["framed"]
        window = FramedWindow(width, height) if is_framed else Window(arguments[2], width, height)
    except DeviceError as error:
        _tell({"error": type(error).__name__, "problem": error.problem, "remedy": error.remedy})
        return
    os.ftruncate(memory_descriptor, count_memory_bytes(width, height))
    with closing(WindowMemory(memory_descriptor, width, height)) as memory:
        memory.fields[Field.WINDOW_BEAT_NS] = time.monotonic_ns()
        memory.fields[Field.APPLICATION_BEAT_NS] = time.monotonic_ns()
        _tell({"output": window.output.name})
        try:
            Keeper(window, memory, wake).run()
        finally:
            window.close()


def _tell(message: dict[str, str]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])

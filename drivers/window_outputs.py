"""The outputs (monitors, projectors) of the X server, as SDL names them."""

import ctypes
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from navapp.errors import DeviceError, DeviceNotFound, WrongDevice

# SDL falls back to drivers that draw into nothing; on Wayland a window cannot choose its place.
_VISIBLE_DRIVER = "x11"


@dataclass(frozen=True, slots=True)
class Output:
    """One output: its number in SDL, its name, where it lies on the desktop and its size, px."""

    index: int
    name: str
    left: int
    top: int
    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.name} ({self.width}x{self.height})"


def start_sdl() -> Any:
    """The module pygame, with SDL's display started on a screen that somebody can see.

    Raises:
        DeviceNotFound: no pygame, no X server, or SDL would draw into nothing.
    """
    os.environ.setdefault("SDL_VIDEODRIVER", _VISIBLE_DRIVER)
    try:
        import pygame
    except ImportError as error:
        raise DeviceNotFound(
            f"a window needs the package pygame-ce ({error})",
            subject="display",
            remedy="install pygame-ce; if it is there, make system-deps",
        ) from error
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error as error:
        raise _no_screen(str(error)) from error
    if driver != _VISIBLE_DRIVER:
        raise _no_screen(f"SDL would draw with '{driver}'")
    return pygame


def list_outputs() -> list[Output]:
    """All outputs; `start_sdl` must have been called.

    pygame tells neither names nor places, the SDL inside it does.

    Raises:
        DeviceError: SDL cannot be asked.
    """
    sdl = ctypes.CDLL(_find_loaded_sdl())
    sdl.SDL_GetDisplayName.restype = ctypes.c_char_p
    found = []
    for index in range(sdl.SDL_GetNumVideoDisplays()):
        bounds = (ctypes.c_int * 4)()
        if sdl.SDL_GetDisplayBounds(index, bounds) != 0:
            raise DeviceError(f"SDL does not tell the place of output {index}")
        name = sdl.SDL_GetDisplayName(index) or b""
        found.append(Output(index, name.decode(errors="replace"), *bounds))
    return found


def choose_output(found: Sequence[Output], name: str, width: int, height: int) -> Output:
    """The output of that name and size, px; without a name the only one.

    Raises:
        DeviceNotFound: none of that name, or several.
        WrongDevice: it has another size.
    """
    listed = ", ".join(map(str, found)) or "none"
    fitting = [output for output in found if name in ("", output.name)]
    if not fitting:
        raise DeviceNotFound(
            f"there is no output '{name}'",
            subject=name,
            remedy=f"connect it, or name one of these under [display] output: {listed}",
        )
    if len(fitting) > 1:
        raise DeviceNotFound(
            f"output '{name}' is not the only one" if name else "there are several outputs",
            subject=name,
            remedy=f"[display] output must tell one of these from the others: {listed}",
        )
    (output,) = fitting
    if (output.width, output.height) != (width, height):
        raise WrongDevice(
            f"output {output} has another size than {width}x{height}",
            subject=output.name,
            remedy="set the output's mode, or [display] size, so that they are equal",
        )
    return output


def _find_loaded_sdl() -> str:
    for line in Path("/proc/self/maps").read_text().splitlines():
        path = line.partition("/")[2]
        if Path(path).name.startswith("libSDL2-"):
            return f"/{path}"
    raise DeviceError("the SDL that pygame has loaded is not found")


def _no_screen(why: str) -> DeviceNotFound:
    return DeviceNotFound(
        f"there is no X11 screen to open a window on ({why})",
        subject="display",
        remedy="start navapp in a graphical session with DISPLAY set, and see make system-deps",
    )

"""Which pictures a terminal draws: asked of the terminal itself, before the screen starts."""

import fcntl
import os
import re
import select
import struct
import termios
import time
import tty
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from navapp.ui.pictures.blocks import CELL_PX, BlockEncoder
from navapp.ui.pictures.kitty import KittyEncoder, ask_whether_drawn
from navapp.ui.pictures.sixel import SixelEncoder
from navapp.ui.pictures.sixel_kernels import N_COLOURS

_PATIENCE_S = 3.0
# Numbers of the two pictures of one pixel that kitty's protocol is asked about.
_LOCAL, _COMPRESSED = 31, 32
_CELL = re.compile(rb"\x1b\[6;(\d+);(\d+)t")
_ATTRIBUTES = re.compile(rb"\x1b\[\?([\d;]+)c")
_REGISTERS = re.compile(rb"\x1b\[\?1;0;(\d+)S")
_SIXEL = b"4"
_REGISTERS_WANTED = 256
# They print what they do not understand.
_SIMPLE_TERMINALS = ("linux", "dumb", "vt100", "vt102")


Wish = Literal["auto", "kitty", "sixel", "blocks"]


class Encoder(Protocol):
    """Turns pictures into what makes the terminal draw them at the cursor."""

    @property
    def is_scaled_by_terminal(self) -> bool:
        """A smaller picture still fills its cells."""
        ...

    @property
    def has_pixels(self) -> bool:
        """It draws pixels, not half blocks."""
        ...

    @property
    def is_busy(self) -> bool:
        """The terminal has not taken the last picture yet."""
        ...

    def encode(self, number: int, picture: NDArray[np.uint8], columns: int, rows: int) -> str:
        """Of (h, w, 3) BGR, over so many cells; what had that number before is replaced."""
        ...

    def erase(self, number: int) -> str:
        """What removes a picture where text alone does not."""
        ...

    def close(self) -> None:
        """Remove what is left outside of the terminal."""
        ...


@dataclass(frozen=True, slots=True)
class Graphics:
    """How pictures come to the screen."""

    encoder: Encoder | None = None  # None: half blocks that Textual writes
    cell_px: tuple[int, int] = (0, 0)  # width and height of a character
    words: str = "half blocks"  # for people; with the reason where they are half blocks

    @property
    def has_colours(self) -> bool:
        """They have so many colours that an outline is seen in them."""
        return self.encoder is not None

    @property
    def has_pixels(self) -> bool:
        """They are drawn in pixels."""
        return self.encoder is not None and self.encoder.has_pixels


@dataclass(frozen=True, slots=True)
class Answers:
    """What a terminal says of itself."""

    has_local_kitty: bool = False  # and it reads this computer's shared memory
    has_kitty: bool = False
    has_sixel: bool = False
    n_registers: int | None = None  # colours of a sixel picture; None: not told
    cell_px: tuple[int, int] | None = None  # None: not told


def compile_encoders() -> None:
    """Compile what pictures take, so that nobody waits for it at the first one."""
    picture = np.zeros((2, 1, 3), np.uint8)
    for encoder in (BlockEncoder(is_true_colour=True), SixelEncoder()):
        encoder.encode(0, picture, 1, 1)


def find_graphics(wish: Wish, environment: Mapping[str, str]) -> Graphics:
    """Ask the terminal at the standard input and output.

    Args:
        wish: what may be used; "auto" is the best that the terminal answers for.
        environment: variables of the process.
    """
    if wish == "blocks":
        return _choose_blocks("as configured", environment)
    if environment.get("TERM", "dumb") in _SIMPLE_TERMINALS:
        return _choose_blocks("this terminal draws no pictures", environment)
    return choose_graphics(wish, ask_terminal(environment), environment)


def choose_graphics(wish: Wish, answers: Answers, environment: Mapping[str, str]) -> Graphics:
    """The best way that was wished and answered for."""
    cell_px = answers.cell_px
    if cell_px is not None and wish in ("auto", "kitty"):
        if answers.has_local_kitty:
            return Graphics(KittyEncoder(is_local=True), cell_px, "kitty, shared memory")
        if answers.has_kitty:
            return Graphics(KittyEncoder(is_local=False), cell_px, "kitty, compressed")
    n_registers = N_COLOURS if answers.n_registers is None else answers.n_registers
    has_colours = n_registers >= N_COLOURS
    if cell_px is not None and wish in ("auto", "sixel") and answers.has_sixel and has_colours:
        return Graphics(SixelEncoder(), cell_px, "sixel")
    if answers.has_sixel and not has_colours:
        why = f"the terminal has {n_registers} colours for sixel, {N_COLOURS} are needed"
    elif "TMUX" in environment:
        why = "tmux passes no pictures on"
    else:
        why = "this terminal draws no pictures"
    return _choose_blocks(why, environment)


def _choose_blocks(why: str, environment: Mapping[str, str]) -> Graphics:
    """Half blocks, written past Textual where the terminal has enough colours."""
    words = f"half blocks: {why}"
    is_true_colour = environment.get("COLORTERM", "").lower() in ("truecolor", "24bit")
    has_colours = is_true_colour or "256color" in environment.get("TERM", "")
    if "NO_COLOR" in environment or not has_colours:
        return Graphics(words=words)
    return Graphics(BlockEncoder(is_true_colour=is_true_colour), CELL_PX, words)


def ask_terminal(environment: Mapping[str, str]) -> Answers:
    """Ask for what the terminal draws; nothing more once it leaves a question unanswered.

    What is typed meanwhile is lost. An answer that comes later than `_PATIENCE_S` would be read as
    keys; every terminal answers the first question, so that this means it is not there.

    Args:
        environment: variables of the process; multiplexers show kitty's question to people.
    """
    settings = termios.tcgetattr(0)
    told, is_local = b"", False
    is_multiplexed = environment.get("TERM", "").startswith(("screen", "tmux")) or bool(
        {"TMUX", "STY"} & set(environment)
    )
    try:
        tty.setcbreak(0)
        told = _ask("")
        if told and not is_multiplexed:
            with ask_whether_drawn(_LOCAL, _COMPRESSED) as question:
                told += _ask(question.text)
                is_local = question.was_read
        if told:
            told += _ask("\x1b[16t")
        if parse_answers(told).has_sixel:
            told += _ask(f"\x1b[?1;3;{_REGISTERS_WANTED}S")
    finally:
        termios.tcsetattr(0, termios.TCSAFLUSH, settings)
    answers = parse_answers(told)
    cell_px = answers.cell_px or measure_cell(1)
    return replace(answers, cell_px=cell_px, has_local_kitty=answers.has_local_kitty and is_local)


def parse_answers(told: bytes) -> Answers:
    """Of what a terminal has sent."""
    cell, registers = _CELL.search(told), _REGISTERS.search(told)
    attributes = {one for found in _ATTRIBUTES.findall(told) for one in found.split(b";")[1:]}
    return Answers(
        has_local_kitty=b"\x1b_Gi=%d;OK" % _LOCAL in told,
        has_kitty=b"\x1b_Gi=%d;OK" % _COMPRESSED in told,
        has_sixel=_SIXEL in attributes,
        n_registers=None if registers is None else int(registers[1]),
        cell_px=None if cell is None else (int(cell[2]), int(cell[1])),
    )


def _ask(questions: str) -> bytes:
    """What is answered, up to the attributes that every terminal tells; empty without them."""
    os.write(1, f"{questions}\x1b[c".encode())
    told, end_s = b"", time.monotonic() + _PATIENCE_S
    while _ATTRIBUTES.search(told) is None:
        ready, _, _ = select.select([0], [], [], max(0.0, end_s - time.monotonic()))
        more = os.read(0, 4096) if ready else b""
        if not more:
            return b""
        told += more
    return told


def measure_cell(descriptor: int) -> tuple[int, int] | None:
    """From the size of the window in cells and pixels; None where the terminal tells not both."""
    try:
        told = fcntl.ioctl(descriptor, termios.TIOCGWINSZ, struct.pack("4H", 0, 0, 0, 0))
    except OSError:
        return None
    rows, columns, width, height = struct.unpack("4H", told)
    if 0 in (rows, columns, width, height):
        return None
    return width // columns, height // rows

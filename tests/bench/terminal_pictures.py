"""Pictures a second, and processor time of each, that this terminal takes.

usage, in the terminal that is to be measured: python -m tests.bench.terminal_pictures FILE
    [--pictures auto|kitty|sixel|blocks|textual] [--compressed] [--size 960x540] [--seconds S]

Simulated pictures of the moving leg, with noise, are painted as the operator's screen paints them,
one as soon as the terminal has taken the last. FILE gets one line.
"""

import argparse
import os
import sys
import time
from dataclasses import replace
from io import StringIO
from itertools import cycle
from pathlib import Path

import numpy as np
from rich.console import Console
from textual.geometry import Region

from navapp.config import load
from navapp.devices import open_live
from navapp.ui.pictures.graphics import find_graphics
from navapp.ui.pictures.halfblocks import compute_cell_codes, make_row_strip
from navapp.ui.pictures.kitty import KittyEncoder
from navapp.ui.pictures.painter import Painter, PictureText

_N_PICTURES, _WARM = 8, 5
_CELLS = 110, 30  # of half blocks


def record_pictures() -> list[np.ndarray]:
    """(720, 1280, 3) each: some pictures of the simulated room."""
    configuration = load(None)
    opened = open_live(configuration, is_headless=True)
    try:
        return [opened.devices.camera.read(1.0).left for _ in range(_N_PICTURES)]
    finally:
        opened.devices.close()


class Terminal:
    """The terminal itself, without a screen."""

    def __init__(self) -> None:
        self.n_bytes, self.sent = 0, PictureText("")

    def write(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()
        self.n_bytes += len(text)
        if isinstance(text, PictureText):
            text.sent_s = time.monotonic()


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--pictures", default="auto")
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument(
        "--compressed", action="store_true", help="kitty as through ssh, without shared memory"
    )
    options = parser.parse_args()
    pictures = record_pictures()
    wish = "blocks" if options.pictures == "textual" else options.pictures
    graphics, terminal = find_graphics(wish, os.environ), Terminal()
    if options.compressed:
        encoder = KittyEncoder(is_local=False)
        graphics = replace(graphics, encoder=encoder, words="kitty, compressed")
    if options.pictures == "textual":
        told = measure_strips(pictures, options.seconds)
    else:
        painter = Painter(graphics, terminal.write)
        size_px = map(int, options.size.split("x"))
        cells = tuple(px // cell for px, cell in zip(size_px, graphics.cell_px, strict=True))
        cells = cells if graphics.has_pixels else _CELLS
        told = measure(painter, pictures, Region(0, 0, *cells), terminal, options.seconds)
        painter.close()
    options.out.write_text(f"{graphics.words}: {told}\n")


def measure(
    painter: Painter,
    pictures: list[np.ndarray],
    region: Region,
    terminal: Terminal,
    seconds: float,
) -> str:
    """Rate, processor time and size at the end."""
    costs_s: list[float] = []
    begun_s, n_bytes, n = time.monotonic(), 0, 0
    for picture in cycle(pictures):
        place = painter.find_place(region)
        if not painter.paint(1, picture, place):
            time.sleep(0.001)
            continue
        costs_s.append(painter.cost_s)
        n += 1
        if n == _WARM:
            begun_s, n_bytes, costs_s = time.monotonic(), terminal.n_bytes, []
        if n > _WARM and time.monotonic() - begun_s > seconds:
            break
    took_s = time.monotonic() - begun_s
    px = "x".join(str(a * b) for a, b in zip(place.size, painter.cell_px, strict=True))
    return (
        f"{(n - _WARM) / took_s:.1f} pictures a second, {1e3 * np.median(costs_s):.1f} ms of "
        f"processor time each (95 %: {1e3 * np.percentile(costs_s, 95):.1f}), "
        f"{(terminal.n_bytes - n_bytes) / (n - _WARM) / 1000:.0f} kB each, over {px} px"
        f" at a scale of {painter.scale:.2f}"
    )


def measure_strips(pictures: list[np.ndarray], seconds: float) -> str:
    """Half blocks that Textual writes: making its strips, and their text as it makes it."""
    costs_s, end_s = [], time.monotonic() + seconds
    console = Console(color_system="truecolor", file=StringIO())
    for picture in cycle(pictures):
        begun_s = time.thread_time()
        for row in compute_cell_codes(picture, *_CELLS):
            make_row_strip(row).render(console)
        costs_s.append(time.thread_time() - begun_s)
        if time.monotonic() > end_s:
            break
    return f"{1e3 * np.median(costs_s):.1f} ms of processor time each, {_CELLS} cells"


if __name__ == "__main__":
    main()

"""Messages on stderr, and results as JSON."""

import json
import math
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from navapp import __version__
from navapp.errors import InputError
from navapp.geometry.whole_files import write_whole


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """Messages on stderr, as many as the options ask for."""

    is_verbose: bool = False
    is_quiet: bool = False

    def say(self, text: str) -> None:
        """A result for people, on stdout."""
        if not self.is_quiet:
            sys.stdout.write(text + "\n")

    def warn(self, text: str) -> None:
        """Something that the user should know, on stderr."""
        if not self.is_quiet:
            sys.stderr.write(f"navapp: warning: {text}\n")

    def note(self, text: str) -> None:
        """What is going on, on stderr."""
        if not self.is_quiet:
            sys.stderr.write(f"navapp: {text}\n")

    def detail(self, text: str) -> None:
        """What only who asked for more wants to know, on stderr."""
        if self.is_verbose and not self.is_quiet:
            sys.stderr.write(f"navapp: {text}\n")

    @property
    def has_live_line(self) -> bool:
        """Stderr is a terminal, and details do not run through it."""
        return not (self.is_quiet or self.is_verbose) and sys.stderr.isatty()

    def tell_live(self, text: str, *, is_last: bool = False) -> None:
        """A line on stderr that the next one replaces; nothing where that cannot be."""
        if self.has_live_line:
            sys.stderr.write(f"\r\x1b[K{text}" + ("\n" if is_last else ""))
            sys.stderr.flush()

    def progress(self, what: str, share: float, after: str = "") -> None:
        """A bar on stderr, when that is a terminal and details do not run through it."""
        if not self.has_live_line:
            return
        n = round(30 * min(max(share, 0.0), 1.0))
        bar = f"{what} [{'#' * n}{'.' * (30 - n)}] {100 * share:3.0f} %{after}"
        self.tell_live(bar, is_last=share >= 1.0)


def report(text: str) -> None:
    """One error sentence on stderr."""
    sys.stderr.write(f"navapp: error: {text}\n")


def check_writable(path: str | None) -> None:
    """Refuse a JSON target that cannot be written before the work begins."""
    if path in (None, "-"):
        return
    target = Path(str(path)).resolve()
    parent = target.parent
    if target.is_dir() or (parent.is_dir() and not os.access(parent, os.W_OK)):
        raise InputError(
            f"{path} cannot be written",
            subject=str(path),
            remedy="name a file in a folder that you may write to",
        )
    if not parent.is_dir():
        raise InputError(
            f"folder {parent} for {path} does not exist",
            subject=str(path),
            remedy="make it, or choose another place",
        )


def write_json(path: str | None, command: str, content: Mapping[str, Any]) -> None:
    """The result for programs: one object, never NaN."""
    if path is None:
        return
    whole = {
        "navapp": __version__,
        "command": command,
        "units": {"length": "mm", "angle": "deg"},
        **content,
    }
    text = json.dumps(replace_not_finite(whole), indent=1, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    else:
        write_whole(path, text.encode("utf-8"))


def replace_not_finite(value: Any) -> Any:
    """The value with None for every number that JSON does not have."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): replace_not_finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [replace_not_finite(item) for item in value]
    return value

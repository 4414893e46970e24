"""OpenCV storage files that end with a hash of all their lines before, and what ours hold."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from navapp.geometry.whole_files import write_whole

_HASH_KEY = "file_sha256"


def write_sealed(path: str | Path, write: Callable[[Any], None]) -> None:
    """Write OpenCV YAML 1.0, or XML for a name that ends so; whole or not at all.

    Args:
        path: of the file.
        write: fills an open `cv2.FileStorage`; the last line, a hash, comes after.
    """
    import cv2

    is_xml = Path(path).suffix.lower() == ".xml"
    # OpenCV 5 writes YAML 1.2 unless asked; older readers know 1.0 only.
    yaml_format = getattr(cv2, "FILE_STORAGE_FORMAT_YAML_1_0", cv2.FILE_STORAGE_FORMAT_YAML)
    form = cv2.FILE_STORAGE_FORMAT_XML if is_xml else yaml_format
    storage = cv2.FileStorage("", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | form)
    write(storage)
    content = storage.releaseAndGetString().encode("utf-8")
    seal = f'{_HASH_KEY}: "{hashlib.sha256(content).hexdigest()}"'
    write_whole(path, content + (f"<!-- {seal} -->\n" if is_xml else f"{seal}\n").encode())


def is_sealed(path: Path) -> bool:
    """Whether the last line is a hash.

    Raises:
        ChangedFileError: it does not fit the lines before.
    """
    # Line ends change on the way through mail and other systems, which alters nothing.
    lines = path.read_bytes().replace(b"\r\n", b"\n").splitlines(keepends=True)
    if not lines or _HASH_KEY.encode() not in lines[-1]:
        return False
    found = hashlib.sha256(b"".join(lines[:-1])).hexdigest()
    if found.encode() not in lines[-1]:
        raise ChangedFileError
    return True


class ChangedFileError(Exception):
    """A sealed file whose lines are not those that were written."""


def write_texts(storage: Any, name: str, texts: Iterable[str]) -> None:
    """A sequence of texts."""
    import cv2

    storage.startWriteStruct(name, cv2.FILE_NODE_SEQ)
    for text in texts:
        storage.write("", text)
    storage.endWriteStruct()


def write_days(storage: Any, made_on: date | None, expires_on: date | None) -> None:
    """Days of a calibration and of its end, where they are known."""
    for name, day in (("made_on", made_on), ("expires_on", expires_on)):
        if day is not None:
            storage.write(name, day.isoformat())


def write_figures(storage: Any, figures: Mapping[str, float]) -> None:
    """Numbers by name."""
    import cv2

    if figures:
        storage.startWriteStruct("figures", cv2.FILE_NODE_MAP)
        for name, value in figures.items():
            storage.write(name, float(value))
        storage.endWriteStruct()


# A node must stay in a variable: the storage frees the ones that nobody holds.


def read_matrix(storage: Any, name: str) -> Any:
    """An array, or None when it is not there."""
    node = storage.getNode(name)
    if node.empty() or node.mat() is None:
        return None
    return np.asarray(node.mat(), dtype=np.float64)


def read_numbers(storage: Any, names: Iterable[str]) -> dict[str, float]:
    """Those of some numbers that are there."""
    values = {}
    for name in names:
        node = storage.getNode(name)
        if not node.empty():
            values[name] = number(node)
    return values


def read_texts(storage: Any, names: Iterable[str]) -> dict[str, str]:
    """Those of some texts that are there."""
    values = {}
    for name in names:
        node = storage.getNode(name)
        if not node.empty() and node.isString():
            values[name] = str(node.string())
    return values


def read_record(storage: Any) -> dict[str, Any]:
    """`figures` and `reasons` of a quality record, those that are there."""
    values: dict[str, Any] = {}
    node = storage.getNode("figures")
    if not node.empty() and node.isMap():
        values["figures"] = {name: number(node.getNode(name)) for name in node.keys()}  # noqa: SIM118 (OpenCV's)
    node = storage.getNode("reasons")
    if not node.empty() and node.isSeq():
        values["reasons"] = [node.at(i).string() for i in range(node.size())]
    elif node.isString():
        # A sequence of one is no sequence in XML.
        values["reasons"] = [node.string()]
    return values


def number(node: Any) -> float:
    """The number of a node.

    Raises:
        ValueError: it is none.
    """
    if not (node.isInt() or node.isReal()):
        raise ValueError("a number was expected")
    return float(node.real())


def day(text: str) -> date | None:
    """A day in ISO's form; None for an empty text."""
    return date.fromisoformat(text) if text else None

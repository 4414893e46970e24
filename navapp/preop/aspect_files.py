"""Reads and writes aspect graphs."""

import zipfile
from pathlib import Path

import numpy as np

from navapp.errors import PlanError
from navapp.values import AspectGraph

_FORMAT = 1
_ARRAYS = ("directions", "starts", "points_mm", "tangents")


def write_aspects(path: str | Path, aspects: AspectGraph) -> None:
    """Write an aspect graph as `.npz`; lengths in single precision, 0.01 mm and finer.

    Raises:
        PlanError: it cannot be written.
    """
    path = Path(path)
    try:
        with path.open("wb") as file:
            np.savez_compressed(
                file,
                format=np.array(_FORMAT),
                bone=np.array(aspects.bone),
                directions=aspects.directions,
                starts=aspects.starts,
                points_mm=aspects.points_mm.astype(np.float32),
                tangents=aspects.tangents.astype(np.float32),
            )
    except OSError as error:
        raise PlanError(
            f"aspects {path} cannot be written ({error.strerror})",
            subject=str(path),
            remedy="check the folder",
        ) from error


def read_aspects(path: str | Path) -> AspectGraph:
    """Read what `write_aspects` wrote.

    Raises:
        PlanError: missing, or no such file.
    """
    path = Path(path)
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            if int(content["format"]) != _FORMAT:
                raise ValueError(f"format {content['format']}")
            arrays = {name: content[name] for name in _ARRAYS}
            return AspectGraph(str(content["bone"]), **arrays)
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise PlanError(
            f"aspects {path} cannot be read ({error})",
            subject=str(path),
            remedy="build them again from the plan's bone",
        ) from error

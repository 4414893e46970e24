"""Reads tables of poses: CSV lines that end in the 16 numbers of a matrix, row by row."""

import csv

import numpy as np

from navapp.geometry.transform import FloatArray

_N_MATRIX = 16


def parse_pose_table(text: str) -> list[tuple[list[str], FloatArray]]:
    """What stands before each matrix, and the matrix (4, 4) as it stands; a heading is left out.

    Raises:
        ValueError: no lines, a line of another length than the first, or a word that is no number.
    """
    lines = [line for line in csv.reader(text.splitlines()) if "".join(line).strip()]
    if lines and not _is_number(lines[0][0]):
        lines = lines[1:]
    if not lines:
        raise ValueError("it holds no poses")
    n_columns = len(lines[0])
    if n_columns <= _N_MATRIX:
        raise ValueError(f"pose 0 has {n_columns} columns, {_N_MATRIX + 1} or more are expected")
    for place, line in enumerate(lines):
        if len(line) != n_columns:
            raise ValueError(f"pose {place} has {len(line)} columns, the first has {n_columns}")
    return [
        (
            [word.strip() for word in line[:-_N_MATRIX]],
            np.array([float(word) for word in line[-_N_MATRIX:]]).reshape(4, 4),
        )
        for line in lines
    ]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True

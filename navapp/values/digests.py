"""A hash of nested plain values: the same for equal content, another one for anything else."""

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Protocol

import numpy as np

from navapp.geometry.mesh import TriangleMesh


class Digest(Protocol):
    """What `hashlib` makes."""

    def update(self, data: bytes, /) -> None:
        """Add bytes."""


def add_value(digest: Digest, label: str, value: Any) -> None:
    """Add a value under a label; mappings by their sorted keys, dataclasses by their fields."""
    if isinstance(value, TriangleMesh):
        # Normals follow from the surface.
        add_value(digest, f"{label}.vertices", value.vertices_mm)
        add_value(digest, f"{label}.faces", value.faces)
    elif isinstance(value, Mapping):
        digest.update(f"{label}:{len(value)}:".encode())
        for key in sorted(value):
            add_value(digest, f"{label}.{key!r}", value[key])
    elif is_dataclass(value):
        digest.update(f"{label}:{type(value).__name__}:".encode())
        for one in fields(value):
            add_value(digest, f"{label}.{one.name}", getattr(value, one.name))
    elif isinstance(value, np.ndarray):
        # With its shape, so that the same bytes cut elsewhere are something else.
        digest.update(f"{label}:{value.dtype}:{value.shape}:".encode())
        digest.update(hashlib.sha256(np.ascontiguousarray(value).tobytes()).digest())
    else:
        digest.update(f"{label}:{value!r}:".encode())

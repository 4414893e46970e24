"""Reads YAML of other programs and checks its entries; each error names file and key."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import RigError
from navapp.geometry.transform import FloatArray


def read_mapping(path: Path, form: str) -> dict[str, Any]:
    """The keys of a YAML file.

    Raises:
        RigError: missing, no YAML, or no mapping.
    """
    import yaml

    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise make_error(path, form, f"cannot be read ({error.strerror})") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise make_error(path, form, "is no YAML") from error
    if not isinstance(content, dict):
        raise make_error(path, form, "holds no keys")
    return content


def find_entry(content: Mapping[str, Any], key: str) -> Any:
    """The entry of a key.

    Raises:
        ValueError: there is none.
    """
    if content.get(key) is None:
        raise ValueError(f"it lacks {key}")
    return content[key]


def parse_numbers(value: Any, key: str, *shape: int) -> FloatArray:
    """Numbers in a shape; without one a row of any length.

    Raises:
        ValueError: not numbers, or not as many.
    """
    try:
        # YAML 1.1 takes 1e-05 for a text; C++ programs write it all the same.
        found = np.array(value, dtype=np.str_).astype(np.float64)
    except ValueError:
        raise ValueError(f"{key} does not hold numbers alone") from None
    if not shape:
        return found.reshape(-1)
    if found.size != int(np.prod(shape)):
        raise ValueError(f"{key} has {found.size} numbers, {int(np.prod(shape))} are expected")
    return found.reshape(shape)


def make_error(path: Path, form: str, problem: str) -> RigError:
    """The error for a foreign file that makes no rig."""
    return RigError(
        f"{form} file {path} {problem}", subject=str(path), remedy="export it again, or calibrate"
    )

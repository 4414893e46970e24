"""Reads and writes files of crosses that an eye aligned with points of the site."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.errors import InputError

if TYPE_CHECKING:
    from calibration.mirror.alignment_fit import Alignments
    from calibration.mirror.alignment_start import AlignedDisplay

_NEEDED = ("width_px", "height_px", "pitch_mm")
_OPTIONAL = ("glass_mm", "mirror_deg", "refractive_index", "reads_upside_down", "viewing_eye")
_DEFAULT_SD_MM = 0.1


def read_alignments(path: str) -> "tuple[AlignedDisplay, Alignments]":
    """The display and its alignments (JSON, keys in docs/calibration.md).

    Raises:
        InputError: missing, damaged, or a key that is missing, unknown or impossible.
    """
    from calibration.mirror.alignment_fit import Alignments

    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise _refusal(path, "does not exist") from None
    except (OSError, ValueError) as error:
        raise _refusal(path, f"is not readable as JSON ({error})") from error
    try:
        display = _parse_display(content["display"])
        rows = content["alignments"]
        pixels = np.array([row["pixel"] for row in rows], dtype=np.float64).reshape(-1, 2)
        points = np.array([row["point_mm"] for row in rows], dtype=np.float64).reshape(-1, 3)
        sds = np.array([float(row.get("sd_mm", _DEFAULT_SD_MM)) for row in rows])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _refusal(path, f"holds no alignments: {type(error).__name__} {error}") from error
    if not (np.isfinite(pixels).all() and np.isfinite(points).all() and (sds > 0.0).all()):
        raise _refusal(path, "holds numbers that are not finite, or an sd_mm that is not positive")
    return display, Alignments(pixels, points, sds)


def write_alignments(path: Path, display: "AlignedDisplay", made: "Alignments") -> None:
    """Write a file that `read_alignments` reads.

    Raises:
        InputError: it cannot be written.
    """
    from navapp.geometry.whole_files import write_whole

    rows = [
        {"pixel": pixel.tolist(), "point_mm": point.tolist(), "sd_mm": float(sd_mm)}
        for pixel, point, sd_mm in zip(made.pixels, made.points_mm, made.points_sd_mm, strict=True)
    ]
    content = {"display": asdict(display), "alignments": rows}
    try:
        write_whole(path, (json.dumps(content, indent=1) + "\n").encode())
    except OSError as error:
        raise InputError(
            f"alignment file {path} cannot be written ({error.strerror})",
            subject=str(path),
            remedy="name a file in a folder that you may write to",
        ) from error


def _parse_display(keys: dict[str, Any]) -> "AlignedDisplay":
    from calibration.mirror.alignment_start import AlignedDisplay
    from navapp.geometry.display_model import VIEWING_EYES

    if missing := [key for key in _NEEDED if key not in keys]:
        raise ValueError(f"display lacks {', '.join(missing)}")
    if unknown := sorted(set(keys) - {*_NEEDED, *_OPTIONAL}):
        raise ValueError(f"display has no {', '.join(unknown)}")
    for key in ("width_px", "height_px"):
        if not isinstance(keys[key], int) or keys[key] < 1:
            raise ValueError(f"{key} must be a whole number above 0")
    if not 0.0 < float(keys["pitch_mm"]) < math.inf:
        raise ValueError("pitch_mm must be a length")
    if keys.get("viewing_eye", "right") not in VIEWING_EYES:
        raise ValueError(f"viewing_eye must be one of {', '.join(VIEWING_EYES)}")
    return AlignedDisplay(**keys)


def _refusal(path: str, problem: str) -> InputError:
    return InputError(
        f"alignment file {path} {problem}",
        subject=path,
        remedy='write one such as {"display": {"width_px": 1920, "height_px": 1080, "pitch_mm": '
        '0.2767}, "alignments": [{"pixel": [960.0, 540.0], "point_mm": [1.0, 2.0, 450.0]}]}',
    )

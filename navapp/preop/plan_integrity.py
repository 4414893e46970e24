"""Digest of a plan's file, and the error for a plan folder that was changed or is damaged."""

import hashlib
from pathlib import Path

from navapp.errors import PlanError


def sha256_of(path: Path) -> str:
    """Hexadecimal digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def make_damage_error(folder: Path, why: str) -> PlanError:
    """What is raised of a plan's folder that was changed, or cannot be read."""
    return PlanError(
        f"plan {folder} is damaged: {why}",
        subject=str(folder),
        remedy="make it again with `navapp plan`",
    )

"""The place of a plan folder: whether it is free, and how a new plan comes there whole."""

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from navapp.errors import PlanError

PLAN_FILE = "plan.json"


def check_place(folder: str | Path, *, may_replace: bool = False) -> None:
    """Refuse a place that is taken, before the work begins.

    Raises:
        PlanError: there is something at that place that is not a plan, or a plan that may not be
            replaced.
    """
    folder = Path(folder)
    if (folder / PLAN_FILE).is_file() and not may_replace:
        raise PlanError(
            f"{folder} holds a plan",
            subject=str(folder),
            remedy="choose a new folder for --out, or add --replace",
        )
    if folder.exists() and not (folder / PLAN_FILE).is_file() and any(_entries(folder)):
        raise PlanError(
            f"{folder} exists and is not a plan",
            subject=str(folder),
            remedy="choose a new folder for --out",
        )
    there = next(
        place for place in (folder.absolute().parent, *folder.absolute().parents) if place.exists()
    )
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise make_write_error(folder, PermissionError(0, "its place is not a folder to write to"))


def put_in_place(temporary: Path, folder: Path) -> None:
    """Rename a complete plan to its place.

    An older plan is moved aside first, and put back when the rename fails.
    """
    if not folder.exists():
        temporary.rename(folder)
        return
    aside = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}.old."))
    try:
        folder.rename(aside / "plan")
        try:
            temporary.rename(folder)
        except OSError:
            (aside / "plan").rename(folder)
            raise
    except OSError:
        # Goes only when it is empty: an older plan that could not be put back stays there.
        with suppress(OSError):
            aside.rmdir()
        raise
    shutil.rmtree(aside, ignore_errors=True)


def make_write_error(folder: Path, error: OSError) -> PlanError:
    """What is raised when a plan's folder cannot be written."""
    return PlanError(
        f"plan folder {folder} cannot be written ({error.strerror})",
        subject=str(folder),
        remedy="choose a folder that you may write to, with space left",
    )


def _entries(folder: Path) -> list[Path]:
    return list(folder.iterdir()) if folder.is_dir() else [folder]

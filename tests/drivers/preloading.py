"""Small C libraries, compiled when a test needs them and preloaded into a child process."""

import mmap
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


def compiled(source: str, folder: Path) -> Path:
    """The library; the test is skipped where it cannot be made."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    built = folder / f"{Path(source).stem}.so"
    command = [compiler, "-shared", "-fPIC", "-O2", "-Wall", "-Wextra", "-Werror"]
    done = subprocess.run(
        [*command, "-o", built, HERE / source, "-ldl"], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        pytest.skip(f"{source} cannot be compiled: {done.stderr.strip()[:200]}")
    return built


def v4l2(folder: Path) -> tuple[Path, dict[str, str]]:
    """The library that plays USB cameras, and its environment; skipped where it cannot play."""
    library = compiled("v4l2_fake.c", folder)
    (folder / "dev").mkdir()
    (folder / "page").write_bytes(bytes(mmap.PAGESIZE))
    root = {"V4L2_FAKE_ROOT": str(folder)}
    opening = "import os; os.open(os.environ['V4L2_FAKE_ROOT'] + '/dev/video0', os.O_RDWR)"
    (folder / "dev" / "video0").touch()
    if "No such device" not in python(library, "-c", opening, **root).stderr:
        pytest.skip("a preloaded library does not answer for the kernel here")
    return library, root


def python(
    library: Path, *arguments: str, removed: tuple[str, ...] = (), **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run Python with the library preloaded, and with some variables set or removed."""
    kept = {name: value for name, value in os.environ.items() if name not in removed}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=HERE.parent.parent,
        env={**kept, **environment, "LD_PRELOAD": str(library)},
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )

import os
import shutil
from pathlib import Path

import pytest

from navapp import environment


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """As at the start of a program: nothing of ours is set; a home of its own."""
    monkeypatch.setattr(environment, "_prepared", False)
    for name in (*environment._DEFAULTS, "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        # Set first, so that the test's own changes are undone afterwards.
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return tmp_path


@pytest.fixture
def copied(monkeypatch, tmp_path):
    """A copy of the kernels under a root of its own."""
    root = Path(environment.__file__).resolve().parent.parent
    for package in environment._PACKAGES:
        for path in (root / package).rglob("*kernels.py"):
            target = tmp_path / "root" / path.relative_to(root)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
    (tmp_path / "root" / "navapp").mkdir(exist_ok=True)
    monkeypatch.setattr(environment, "__file__", str(tmp_path / "root/navapp/environment.py"))
    return tmp_path / "root"


def test_every_variable_is_set(fresh):
    environment.prepare()
    for name, value in environment._DEFAULTS.items():
        assert os.environ[name] == value
    assert os.environ["DEPTHAI_TELEMETRY"] == "0"


def test_what_the_user_has_set_is_respected(fresh, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.setenv("DEPTHAI_LEVEL", "")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere/else")
    environment.prepare()
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert os.environ["DEPTHAI_LEVEL"] == ""
    assert os.environ["NUMBA_CACHE_DIR"] == "/somewhere/else"


def test_a_second_call_changes_nothing(fresh, monkeypatch):
    environment.prepare()
    monkeypatch.delenv("OMP_NUM_THREADS")
    environment.prepare()
    assert "OMP_NUM_THREADS" not in os.environ


def test_kernels_are_cached_in_the_users_cache_under_their_hash(fresh):
    environment.prepare()
    expected = fresh / "home" / ".cache" / "navapp" / f"numba-{environment.kernel_hash()}"
    assert Path(os.environ["NUMBA_CACHE_DIR"]) == expected


def test_the_configured_cache_comes_first(fresh, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(fresh / "xdg"))
    environment.prepare()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_relative_to(fresh / "xdg")


def test_a_configured_cache_that_cannot_be_made_gives_way_to_the_home(fresh, monkeypatch):
    (fresh / "file").write_bytes(b"")
    monkeypatch.setenv("XDG_CACHE_HOME", str(fresh / "file" / "cache"))
    environment.prepare()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_relative_to(fresh / "home")


@pytest.mark.parametrize("obstacle", ["file", "read-only"])
def test_a_home_that_cannot_be_written_gives_way_to_a_temporary_folder(
    fresh, monkeypatch, obstacle
):
    if obstacle == "file":
        (fresh / "file").write_bytes(b"")
        monkeypatch.setenv("HOME", str(fresh / "file"))
    else:
        monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    monkeypatch.setenv("TMPDIR", str(fresh / "tmp"))
    environment.prepare()
    cache = Path(os.environ["NUMBA_CACHE_DIR"])
    assert cache.is_relative_to(fresh / "tmp")
    assert str(os.getuid()) in cache.parts[-3]


def test_the_hash_is_that_of_the_sources_not_of_their_place(copied, monkeypatch):
    here = environment.kernel_hash()
    monkeypatch.undo()
    assert environment.kernel_hash() == here


def test_the_hash_changes_with_any_kernel_file(copied):
    files = sorted(copied.rglob("*kernels.py"))
    assert len(files) >= 3
    hashes = [environment.kernel_hash()]
    for path in files:
        path.write_text(path.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
        hashes.append(environment.kernel_hash())
    (copied / "navapp" / "new_kernels.py").write_text("", encoding="utf-8")
    hashes.append(environment.kernel_hash())
    assert len(set(hashes)) == len(files) + 2


def test_the_hash_ignores_other_files(copied):
    before = environment.kernel_hash()
    (copied / "navapp" / "other.py").write_text("x = 1\n", encoding="utf-8")
    assert environment.kernel_hash() == before

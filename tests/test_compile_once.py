"""Kernels that are cached are compiled under a lock of all processes, others are not."""

import fcntl

import pytest
from numba import njit

from navapp.registration.lookup_kernels import find_voxel
from tests import compile_once


def is_locked(kernel) -> bool:
    with compile_once.lock_of(kernel).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


@pytest.fixture
def seen(monkeypatch, tmp_path) -> list[bool]:
    """Whether the lock was held, at each compilation."""
    held: list[bool] = []
    monkeypatch.setattr(compile_once, "FOLDER", tmp_path / "locks")
    monkeypatch.setattr(compile_once, "_compile", lambda kernel, _: held.append(is_locked(kernel)))
    return held


def test_a_cached_kernel_is_compiled_by_one_at_a_time(seen) -> None:
    compile_once.compile_once(find_voxel, ())
    assert seen == [True]
    assert not is_locked(find_voxel)


def test_a_kernel_without_a_cache_waits_for_nobody(seen, tmp_path) -> None:
    (tmp_path / "locks").mkdir()
    compile_once.compile_once(njit(lambda x: x), ())
    assert seen == [False]

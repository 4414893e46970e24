"""One worker compiles a kernel; the others wait, and read it from the cache."""

import fcntl
import hashlib
from pathlib import Path
from typing import Any

from numba.core.caching import NullCache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

FOLDER = Path(__file__).resolve().parent.parent / ".pytest_cache" / "kernel-locks"

_compile = Dispatcher.compile


def lock_of(kernel: Dispatcher) -> Path:
    """File that is locked while a kernel is compiled or read."""
    source = f"{kernel.py_func.__code__.co_filename}:{kernel.py_func.__qualname__}"
    return FOLDER / hashlib.sha256(source.encode()).hexdigest()[:24]


def compile_once(kernel: Dispatcher, signature: Any) -> Any:
    """`Dispatcher.compile`, of a kernel that is cached by one process at a time.

    A kernel waits for those that it calls, never the other way round: nobody waits in a circle.
    """
    if isinstance(kernel._cache, NullCache):
        return _compile(kernel, signature)
    FOLDER.mkdir(parents=True, exist_ok=True)
    # First the lock of this process, as its other threads take it inside.
    with global_compiler_lock, lock_of(kernel).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return _compile(kernel, signature)


def install() -> None:
    """For all kernels from now on."""
    Dispatcher.compile = compile_once

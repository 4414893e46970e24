"""The exception of a failed contract check, and helpers that all checks use."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol, TypeVar

S = TypeVar("S")

_LEAST_PATIENCE_S = 2.0


class ContractViolation(AssertionError):  # noqa: N818 (the device's fault, not an error of ours)
    """A device broke its contract; the text is a sentence."""


def require(is_kept: bool, sentence: str) -> None:
    """Raise `ContractViolation` with that sentence unless the contract is kept."""
    if not is_kept:
        raise ContractViolation(sentence)


def require_raises(
    kinds: type[Exception] | tuple[type[Exception], ...], action: Callable[[], object], what: str
) -> None:
    """Raise `ContractViolation` unless the action raises one of these."""
    expected = kinds if isinstance(kinds, tuple) else (kinds,)
    names = " or ".join(kind.__name__ for kind in expected)
    try:
        action()
    except expected:
        return
    except Exception as error:
        raise ContractViolation(f"{what} must raise {names}, not {error!r}") from error
    raise ContractViolation(f"{what} must raise {names}, but went through")


@contextmanager
def must_work(what: str) -> Iterator[None]:
    """Turn any error inside into a `ContractViolation`."""
    try:
        yield
    except ContractViolation:
        raise
    except Exception as error:
        raise ContractViolation(f"{what} must never fail, but raised {error!r}") from error


class Openable(Protocol):
    """What every device of a contract has."""

    def open(self) -> None:
        """Start."""
        ...

    def close(self) -> None:
        """Stop."""
        ...


@contextmanager
def open_subject(
    make: Callable[[], S], device_of: Callable[[S], Openable], what: str
) -> Iterator[S]:
    """A fresh subject whose device is open inside, and closed afterwards whatever happens."""
    subject = make()
    try:
        with must_work(f"opening {what}"):
            device_of(subject).open()
        yield subject
    finally:
        device_of(subject).close()


@contextmanager
def must_return_soon(what: str, limit_s: float) -> Iterator[None]:
    """Raise `ContractViolation` when the inside takes longer on the wall than that, and slack."""
    begin_s = time.monotonic()
    yield
    taken_s = time.monotonic() - begin_s
    require(
        taken_s <= limit_s + _LEAST_PATIENCE_S,
        f"{what} took {taken_s:.1f} s where {limit_s:.1f} s were allowed",
    )


@contextmanager
def must_leave_nothing(what: str) -> Iterator[None]:
    """Raise `ContractViolation` when a thread or a file descriptor more is there afterwards."""
    threads, n_descriptors = set(threading.enumerate()), _n_descriptors()
    yield
    deadline_s = time.monotonic() + _LEAST_PATIENCE_S
    while True:
        left = [thread.name for thread in threading.enumerate() if thread not in threads]
        n_more = _n_descriptors() - n_descriptors
        if not left and n_more <= 0:
            return
        if time.monotonic() > deadline_s:
            break
        time.sleep(0.01)
    require(not left, f"{what} left threads running: {', '.join(left)}")
    require(n_more <= 0, f"{what} left {n_more} file descriptors open")


def _n_descriptors() -> int:
    """Open descriptors of this process; 0 where the system does not tell."""
    folder = Path("/proc/self/fd")
    return len(os.listdir(folder)) if folder.is_dir() else 0

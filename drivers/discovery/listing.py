"""Result of listing one kind of device: what was found, and what could not be examined."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from navapp.errors import NavappError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Unseen:
    """Something that could not be examined, and why."""

    subject: str  # what it is about, for programs
    problem: str  # a sentence without its full stop
    remedy: str  # what a person can do

    @classmethod
    def because(cls, error: NavappError) -> "Unseen":
        """An error that here is an answer."""
        return cls(error.subject, error.problem, error.remedy)


@dataclass(frozen=True, slots=True)
class Listing(Generic[T]):
    """Devices of one kind that were found, and what could not be examined."""

    found: tuple[T, ...] = ()
    unseen: tuple[Unseen, ...] = ()

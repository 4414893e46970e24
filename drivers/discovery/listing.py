"""What a look at one kind of device gives: devices, and what could not be looked at."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from navapp.errors import NavappError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Unseen:
    """Something that could not be looked at.

    Attributes:
        subject: what it is about, for programs.
        problem: a sentence without its full stop.
        remedy: what a person can do.
    """

    subject: str
    problem: str
    remedy: str

    @classmethod
    def because(cls, error: NavappError) -> "Unseen":
        """An error that here is an answer."""
        return cls(error.subject, error.problem, error.remedy)


@dataclass(frozen=True, slots=True)
class Listing(Generic[T]):
    """The devices of a kind, and what is not known of them."""

    found: tuple[T, ...] = ()
    unseen: tuple[Unseen, ...] = ()

"""What a session stands on; nothing of it changes while it runs."""

from dataclasses import dataclass
from datetime import date

from navapp.config import Configuration
from navapp.control.specification import SessionSpecification


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Settings and calibrations of a session, for the pages that show them."""

    configuration: Configuration  # in force, with the command line's words in it
    specification: SessionSpecification  # of the session
    today: date
    source: str = ""  # of the configuration: the file that was read; empty: none

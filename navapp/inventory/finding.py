"""One result of `navapp doctor`."""

from dataclasses import dataclass
from enum import Enum


class Health(Enum):
    """What a finding means for a session of this configuration."""

    OK = "ok"
    WARNING = "warning"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check."""

    name: str  # of it
    health: Health  # FAILED: the configured session cannot do without it
    detail: str  # what was seen
    remedy: str = ""  # what to do when it is not OK


def judge_health(is_fine: bool, is_needed: bool) -> Health:
    """OK, or how bad it is that it is not."""
    if is_fine:
        return Health.OK
    return Health.FAILED if is_needed else Health.WARNING

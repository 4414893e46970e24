"""The contract of a projector's control line."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from drivers.contracts.violation import (
    ContractViolation,
    must_leave_nothing,
    must_return_soon,
    must_work,
    open_subject,
    require,
    require_raises,
)
from drivers.interfaces import CommandResult, PowerState, ProjectorControl, ProjectorStatus
from navapp.errors import DeviceLost, UnsupportedControl


@dataclass(frozen=True, slots=True)
class ProjectorUnderTest:
    """A control line that was never opened."""

    projector: ProjectorControl  # fresh; the checks open and close it
    source: str | None = None  # a picture source that it has; None when that is not known
    timeout_s: float = 150.0  # within which any command is finished, lamp included


MakeProjector = Callable[[], ProjectorUnderTest]

_LIT = (PowerState.ON, PowerState.WARMING)
_UNLIT = (PowerState.STANDBY, PowerState.COOLING)


def check_opening_and_closing_in_any_state(make: MakeProjector) -> None:
    """Opening twice is harmless; closing works before opening, twice, and after a command."""
    subject = make()
    projector = subject.projector
    with must_work("opening or closing a projector"):
        projector.close()
        projector.open()
        projector.open()
        projector.close()
        projector.close()
        projector.open()
        projector.status()
        projector.close()


def check_not_open(make: MakeProjector) -> None:
    """Not open, it says that it is lost; an absent one says so, and refuses every command."""
    subject = make()
    projector = subject.projector
    for when in ("before opening", "after closing"):
        try:
            is_absent = projector.status().power is PowerState.ABSENT
        except DeviceLost:
            is_absent = False
        else:
            require(is_absent, f"asking for the status {when} must raise DeviceLost")
        error = UnsupportedControl if is_absent else DeviceLost
        for name, command in _commands(subject):
            require_raises(error, command, f"{name} {when}")
        projector.open()
        projector.close()


def check_absence(make: MakeProjector) -> None:
    """An absent projector refuses every command; a present one never says that it is absent."""
    with _open_subject(make) as subject:
        if _status(subject).power is PowerState.ABSENT:
            for name, command in _commands(subject):
                require_raises(UnsupportedControl, command, f"{name} of an absent projector")
            require(
                _status(subject) == ProjectorStatus(PowerState.ABSENT),
                "an absent projector has nothing to tell but its absence",
            )


def check_power(make: MakeProjector) -> None:
    """The lamp goes on and off; what is called verified is what is read back."""
    with _open_subject(make) as subject:
        for is_on, states in ((True, _LIT), (False, _UNLIT)):
            result = _ask(subject, "power", partial(_power, subject, is_on))
            if result is None:
                return
            power = _status(subject).power
            if result is CommandResult.VERIFIED:
                require(power in states, f"power {is_on} is called verified, but reads {power}")


def check_mute_and_flips(make: MakeProjector) -> None:
    """Mute and flips: what is called verified is what is read back."""
    with _open_subject(make) as subject:
        projector, timeout_s = subject.projector, subject.timeout_s
        if _ask(subject, "power", lambda: _power(subject, True)) is None:
            return
        for is_set in (True, False):
            result = _ask(subject, "mute", partial(projector.set_mute, is_set, timeout_s))
            if result is CommandResult.VERIFIED:
                require(_status(subject).is_muted is is_set, "mute is called verified but differs")
            result = _ask(
                subject,
                "flips",
                partial(projector.set_flips, is_set, not is_set, timeout_s),
            )
            status = _status(subject)
            if result is CommandResult.VERIFIED:
                flips = (status.flips_horizontally, status.flips_vertically)
                require(flips == (is_set, not is_set), "flips are called verified but differ")
        _ask(subject, "power", lambda: _power(subject, False))


def check_source(make: MakeProjector) -> None:
    """A source that it has is chosen; one that cannot exist is never called verified."""
    with _open_subject(make) as subject:
        projector, timeout_s, source = subject.projector, subject.timeout_s, subject.source
        if source is None or _ask(subject, "power", lambda: _power(subject, True)) is None:
            return
        result = _ask(subject, "source", lambda: projector.set_source(source, timeout_s))
        if result is CommandResult.VERIFIED:
            require(_status(subject).source == source, "the source is called verified but differs")
        require_raises(
            UnsupportedControl,
            lambda: projector.set_source("no such source", timeout_s),
            "choosing a source that does not exist",
        )
        _ask(subject, "power", lambda: _power(subject, False))


def check_nothing_is_left(make: MakeProjector) -> None:
    """After closing no thread and no file descriptor remains."""
    with _open_subject(make) as subject:
        _status(subject)
    subject = make()
    with must_leave_nothing("the projector"):
        subject.projector.open()
        try:
            _status(subject)
        finally:
            subject.projector.close()


PROJECTOR_CHECKS: tuple[Callable[[MakeProjector], None], ...] = (
    check_opening_and_closing_in_any_state,
    check_not_open,
    check_absence,
    check_power,
    check_mute_and_flips,
    check_source,
    check_nothing_is_left,
)


@contextmanager
def _open_subject(make: MakeProjector) -> Iterator[ProjectorUnderTest]:
    with open_subject(make, lambda subject: subject.projector, "a projector") as subject:
        require(bool(subject.projector.name), "a projector needs a name")
        yield subject


def _commands(subject: ProjectorUnderTest) -> tuple[tuple[str, Callable[[], CommandResult]], ...]:
    projector, timeout_s = subject.projector, subject.timeout_s
    return (
        ("set_power", lambda: projector.set_power(False, timeout_s)),
        ("set_source", lambda: projector.set_source(subject.source or "30", timeout_s)),
        ("set_mute", lambda: projector.set_mute(False, timeout_s)),
        ("set_flips", lambda: projector.set_flips(False, False, timeout_s)),
    )


def _power(subject: ProjectorUnderTest, is_on: bool) -> CommandResult:
    return subject.projector.set_power(is_on, subject.timeout_s)


def _ask(
    subject: ProjectorUnderTest, what: str, command: Callable[[], CommandResult]
) -> CommandResult | None:
    """Result of a command; None when the projector does not have it."""
    with must_return_soon(f"setting {what}", subject.timeout_s):
        try:
            result = command()
        except UnsupportedControl:
            return None
        except Exception as error:
            raise ContractViolation(f"setting {what} raised {error!r}") from error
    require(isinstance(result, CommandResult), f"setting {what} must return a CommandResult")
    return result


def _status(subject: ProjectorUnderTest) -> ProjectorStatus:
    with must_work("asking an open projector for its status"):
        return subject.projector.status()

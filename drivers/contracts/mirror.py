"""The contract of a mirror mount."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial

from drivers.contracts.violation import (
    must_leave_nothing,
    must_return_soon,
    must_work,
    open_subject,
    require,
    require_raises,
)
from drivers.interfaces import MirrorMount
from navapp.errors import DeviceLost, UnsupportedControl


@dataclass(frozen=True, slots=True)
class MirrorUnderTest:
    """A mount that was never opened and, when movable, not homed."""

    mirror: MirrorMount  # fresh; the checks open and close it
    angle_deg: float  # where it can be moved to, or where it is fixed
    tolerance_deg: float = 0.05  # how near it gets
    timeout_s: float = 30.0  # within which it is homed, or moved


MakeMirror = Callable[[], MirrorUnderTest]

_OUT_OF_RANGE_DEG = 1e6


def check_opening_and_closing_in_any_state(make: MakeMirror) -> None:
    """Opening twice is harmless; closing works before opening, twice, and after homing."""
    subject = make()
    mirror = subject.mirror
    with must_work("opening or closing a mirror mount"):
        mirror.close()
        mirror.open()
        mirror.open()
        mirror.close()
        mirror.close()
        mirror.open()
        mirror.home(subject.timeout_s)
        mirror.close()


def check_not_open(make: MakeMirror) -> None:
    """A movable mount that is not open says that it is lost; a fixed one refuses to move."""
    subject = make()
    mirror = subject.mirror
    for when in ("before opening", "after closing"):
        error = DeviceLost if mirror.info.is_movable else UnsupportedControl
        require_raises(
            error, lambda: mirror.move_to(subject.angle_deg, subject.timeout_s), f"moving {when}"
        )
        if mirror.info.is_movable:
            require_raises(DeviceLost, lambda: mirror.home(subject.timeout_s), f"homing {when}")
        mirror.open()
        mirror.close()


def check_moving_needs_homing(make: MakeMirror) -> None:
    """Before homing, a movable mount refuses to move and does not know where it stands."""
    with _open_subject(make) as subject:
        mirror = subject.mirror
        if not mirror.info.is_movable:
            return
        require(mirror.position_deg() is None, "before homing the position is not known")
        require_raises(
            UnsupportedControl,
            lambda: mirror.move_to(subject.angle_deg, subject.timeout_s),
            "moving before homing",
        )


def check_position_after_homing(make: MakeMirror) -> None:
    """After homing the position is known; a fixed mount knows it always."""
    with _open_subject(make) as subject:
        mirror = subject.mirror
        if not mirror.info.is_movable:
            _require_at(subject, "a fixed mirror")
        _home(subject)
        require(mirror.position_deg() is not None, "after homing the position must be known")


def check_moving(make: MakeMirror) -> None:
    """A movable mount arrives where it is sent; a fixed one refuses and stays."""
    with _open_subject(make) as subject:
        mirror = subject.mirror
        _home(subject)
        if mirror.info.is_movable:
            with must_work("moving"), must_return_soon("moving", subject.timeout_s):
                mirror.move_to(subject.angle_deg, subject.timeout_s)
            _require_at(subject, "a moved mirror")
            return
        for angle_deg in (subject.angle_deg, subject.angle_deg + 1.0):
            require_raises(
                UnsupportedControl,
                partial(mirror.move_to, angle_deg, subject.timeout_s),
                "moving a fixed mirror",
            )
        _require_at(subject, "a fixed mirror")


def check_impossible_angles(make: MakeMirror) -> None:
    """An angle out of range, or none at all, is refused before anything moves."""
    with _open_subject(make) as subject:
        mirror = subject.mirror
        _home(subject)
        before_deg = mirror.position_deg()
        for angle_deg in (_OUT_OF_RANGE_DEG, -_OUT_OF_RANGE_DEG, float("nan")):
            require_raises(
                UnsupportedControl,
                partial(mirror.move_to, angle_deg, subject.timeout_s),
                f"moving to {angle_deg:g} deg",
            )
        require(mirror.position_deg() == before_deg, "a refused move moved the mirror")


def check_stop(make: MakeMirror) -> None:
    """`stop` works when nothing moves, twice, also before homing."""
    with _open_subject(make) as subject, must_work("stopping"), must_return_soon("stopping", 1.0):
        subject.mirror.stop()
        subject.mirror.stop()


def check_info(make: MakeMirror) -> None:
    """`info` never fails and stays the same kind of mount."""
    subject = make()
    with must_work("asking a closed mount for its info"):
        before = subject.mirror.info
    require(bool(before.name) and bool(before.backend), "name and backend must not be empty")
    is_marked = before.name.startswith("sim:")
    require(is_marked == before.is_simulated, "a simulated mount's name begins with sim:")
    with _open_subject(lambda: subject):
        require(subject.mirror.info.is_movable == before.is_movable, "a mount changed its kind")


def check_nothing_is_left(make: MakeMirror) -> None:
    """After closing no thread and no file descriptor remains."""
    with _open_subject(make) as subject:
        subject.mirror.position_deg()
    subject = make()
    with must_leave_nothing("the mirror mount"):
        subject.mirror.open()
        try:
            _home(subject)
        finally:
            subject.mirror.close()


MIRROR_CHECKS: tuple[Callable[[MakeMirror], None], ...] = (
    check_opening_and_closing_in_any_state,
    check_not_open,
    check_moving_needs_homing,
    check_position_after_homing,
    check_moving,
    check_impossible_angles,
    check_stop,
    check_info,
    check_nothing_is_left,
)


def _open_subject(make: MakeMirror) -> AbstractContextManager[MirrorUnderTest]:
    return open_subject(make, lambda subject: subject.mirror, "a mirror mount")


def _home(subject: MirrorUnderTest) -> None:
    with must_work("homing"), must_return_soon("homing", subject.timeout_s):
        subject.mirror.home(subject.timeout_s)


def _require_at(subject: MirrorUnderTest, what: str) -> None:
    position_deg = subject.mirror.position_deg()
    is_there = (
        position_deg is not None and abs(position_deg - subject.angle_deg) <= subject.tolerance_deg
    )
    require(is_there, f"{what} tells {position_deg} deg instead of {subject.angle_deg:g} deg")

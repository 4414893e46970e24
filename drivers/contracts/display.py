"""The contract of a display."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.contracts.violation import (
    must_leave_nothing,
    must_return_soon,
    must_work,
    open_subject,
    require,
    require_raises,
)
from drivers.frames import Image
from drivers.interfaces import Display
from navapp.errors import DeviceLost


@dataclass(frozen=True, slots=True)
class DisplayUnderTest:
    """A display that was never opened, and an eye on it."""

    display: Display  # fresh; the checks open and close it
    clock: Clock  # the one that its expiries are from
    # what can be seen on it now, (H, W, 3) uint8 BGR; black also when it is off.
    visible_image: Callable[[], Image]
    latency_ns: int = 0  # within which a picture is there, or gone


MakeDisplay = Callable[[], DisplayUnderTest]

# Long enough that no check is slow enough to see its own picture expire.
_LONG_NS = 60_000_000_000


def check_black_before_showing(make: MakeDisplay) -> None:
    """Black after opening; opening again changes nothing."""
    with _open_subject(make) as subject:
        _require_black(subject, "a display that has shown nothing")
        _show(subject, _LONG_NS)
        with must_work("opening an open display"):
            subject.display.open()
        _require_picture(subject)


def check_picture_is_shown(make: MakeDisplay) -> None:
    """What is shown is seen, pixel for pixel, with just the flips that `info` tells."""
    with _open_subject(make) as subject:
        _show(subject, _LONG_NS)
        _require_picture(subject)


def check_picture_is_its_own(make: MakeDisplay) -> None:
    """Writing into the array after `show` changes nothing on the display."""
    with _open_subject(make) as subject:
        image = _test_image(subject)
        subject.display.show(image, subject.clock.now_ns() + _LONG_NS)
        image[:] = 0
        _require_picture(subject)


def check_black_after_expiry(make: MakeDisplay) -> None:
    """Black by itself when the picture expires."""
    with _open_subject(make) as subject:
        duration_ns = 50_000_000
        _show(subject, duration_ns)
        subject.clock.wait_until_ns(subject.clock.now_ns() + duration_ns + subject.latency_ns)
        _require_black(subject, "a display whose picture expired")


def check_newer_picture_replaces(make: MakeDisplay) -> None:
    """The newest picture counts, and its own expiry."""
    with _open_subject(make) as subject:
        dark = np.zeros_like(_test_image(subject))
        subject.display.show(dark, subject.clock.now_ns() + 1_000_000)
        _show(subject, _LONG_NS)
        subject.clock.wait_until_ns(subject.clock.now_ns() + 2_000_000)
        _require_picture(subject)


def check_expired_picture_is_not_shown(make: MakeDisplay) -> None:
    """A picture that comes too late is never seen."""
    with _open_subject(make) as subject:
        for age_ns in (0, 1, 1_000_000_000):
            with must_work("showing an expired picture"):
                subject.display.show(_test_image(subject), subject.clock.now_ns() - age_ns)
            _settle(subject)
            _require_black(subject, "a display that got an expired picture")


def check_black_after_blank(make: MakeDisplay) -> None:
    """`blank` makes it black at once, and it can show again."""
    with _open_subject(make) as subject:
        _show(subject, _LONG_NS)
        with must_return_soon("blanking", 0.0):
            subject.display.blank()
        _settle(subject)
        _require_black(subject, "a blanked display")
        _show(subject, _LONG_NS)
        _require_picture(subject)


def check_black_after_close(make: MakeDisplay) -> None:
    """Closing makes it black, also when it is opened again."""
    with _open_subject(make) as subject:
        _show(subject, _LONG_NS)
        subject.display.close()
        _require_black(subject, "a closed display")
        subject.display.open()
        _settle(subject)
        _require_black(subject, "a display that was opened again")
        _show(subject, _LONG_NS)
        _require_picture(subject)


def check_wrong_pictures_are_refused(make: MakeDisplay) -> None:
    """Another size, type or number of channels is refused, and the display goes on to work."""
    with _open_subject(make) as subject:
        right = _test_image(subject)
        wrong: tuple[NDArray[Any], ...] = (
            right[1:],
            right[:, 1:],
            right[:, :, 0],
            right.astype(np.float32),
        )
        for image in wrong:
            until_ns = subject.clock.now_ns() + _LONG_NS
            require_raises(
                ValueError,
                partial(subject.display.show, image, until_ns),
                f"showing a picture of shape {image.shape} and type {image.dtype}",
            )
        _require_black(subject, "a display that refused all pictures")
        _show(subject, _LONG_NS)
        _require_picture(subject)


def check_showing_when_not_open(make: MakeDisplay) -> None:
    """Showing on a display that is not open, or no longer, says that it is lost."""
    subject = make()
    display, image = subject.display, _test_image(subject)
    until_ns = subject.clock.now_ns() + _LONG_NS
    require_raises(DeviceLost, lambda: display.show(image, until_ns), "showing before opening")
    display.open()
    display.close()
    require_raises(DeviceLost, lambda: display.show(image, until_ns), "showing after closing")


def check_blank_and_close_in_any_state(make: MakeDisplay) -> None:
    """`blank` and `close` work in every state, twice."""
    subject = make()
    display = subject.display
    with must_work("blanking or closing"), must_return_soon("blanking or closing", 10.0):
        display.blank()
        display.close()
        display.open()
        for _ in range(2):
            display.blank()
        for _ in range(2):
            display.close()
        display.blank()
    _require_black(subject, "a closed display")


def check_nothing_is_left(make: MakeDisplay) -> None:
    """After closing no thread and no file descriptor remains."""
    with _open_subject(make) as subject:
        _show(subject, _LONG_NS)
    subject = make()
    with must_leave_nothing("the display"):
        subject.display.open()
        try:
            _show(subject, _LONG_NS)
        finally:
            subject.display.close()


DISPLAY_CHECKS: tuple[Callable[[MakeDisplay], None], ...] = (
    check_black_before_showing,
    check_picture_is_shown,
    check_picture_is_its_own,
    check_black_after_expiry,
    check_newer_picture_replaces,
    check_expired_picture_is_not_shown,
    check_black_after_blank,
    check_black_after_close,
    check_wrong_pictures_are_refused,
    check_showing_when_not_open,
    check_blank_and_close_in_any_state,
    check_nothing_is_left,
)


def _open_subject(make: MakeDisplay) -> AbstractContextManager[DisplayUnderTest]:
    return open_subject(make, lambda subject: subject.display, "a display")


def _test_image(subject: DisplayUnderTest) -> Image:
    """Every flip, turn and swap of channels makes it another picture."""
    info = subject.display.info
    image = np.zeros((info.height, info.width, 3), np.uint8)
    image[: info.height // 2, : info.width // 3] = (40, 120, 240)
    image[info.height // 2 :, : info.width // 5] = (200, 30, 90)
    return image


def _show(subject: DisplayUnderTest, duration_ns: int) -> None:
    with must_work("showing a picture"):
        subject.display.show(_test_image(subject), subject.clock.now_ns() + duration_ns)


def _settle(subject: DisplayUnderTest) -> None:
    subject.clock.wait_until_ns(subject.clock.now_ns() + subject.latency_ns)


def _require_black(subject: DisplayUnderTest, what: str) -> None:
    require(not subject.visible_image().any(), f"{what} must be black")


def _require_picture(subject: DisplayUnderTest) -> None:
    _settle(subject)
    expected = _test_image(subject)
    if subject.display.info.flips_horizontally:
        expected = expected[:, ::-1]
    if subject.display.info.flips_vertically:
        expected = expected[::-1]
    seen = subject.visible_image()
    require(seen.shape == expected.shape, f"the display shows a picture of shape {seen.shape}")
    require(np.array_equal(seen, expected), "the display does not show the picture it was given")

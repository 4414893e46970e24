"""One axis of a Zaber device: motions followed to their end, and flags that mark one as failed.

A reply says OK when a command was accepted, not when the axis has arrived.
"""

import re
from collections.abc import Callable
from contextlib import suppress

from drivers.clock import Clock
from drivers.zaber_line import Reply, ZaberLine, make_rejection
from drivers.zaber_warnings import costs_reference, describe, is_harmless
from navapp.errors import DeviceError, DeviceProtocolError, DeviceTimeout

WHOLE = re.compile(r"-?\d{1,12}")
# Shown from the beginning of a motion to its end, whatever the device says.
INTERRUPTED = ("NI",)

_FLAGS = re.compile(r"\d{2}( [A-Z][A-Z0-9])*")
_POLL_NS, _RETRY_NS = 50_000_000, 50_000_000
_RETRY_S = 2.0
_HOME, _CLEAR = "home", "warnings clear"
_LATER = ("AGAIN", "STATUSBUSY", "FULL")


class ZaberAxis:
    """One axis: its place, its motions, and the flags that mark a motion as failed.

    Attributes:
        talk: the line of its device.
        is_homed: its position counts from its home; so it is at first if its flags do not deny it,
            and what denied it once does so until it is homed, also over a reopening.
        against: flags since it was last sent somewhere that speak against its standing there.
    """

    def __init__(self, talk: ZaberLine, clock: Clock) -> None:
        self.talk = talk
        self._clock = clock
        self._is_stop_asked = False
        self.is_homed = True
        self.against: tuple[str, ...] = ()

    @property
    def is_placed(self) -> bool:
        """It stands where it was sent, as far as it says."""
        return self.is_homed and not self.against

    def look(self) -> bool:
        """Note all flags; whether it moves.

        Raises:
            DeviceLost, DeviceTimeout, DeviceProtocolError.
        """
        reply = self.talk.ask("")
        if reply.warning:
            self.note(reply.warning)
            # A reply shows the most urgent flag only; `warnings` counts and lists them all.
            every = self.talk.ask("warnings")
            if not every.is_accepted or _FLAGS.fullmatch(every.data) is None:
                raise DeviceProtocolError(
                    f"the mirror lists its warnings as {every.data[:60]!r}", subject="mirror"
                )
            for flag in (every.warning, *every.data.split()[1:]):
                self.note(flag)
        return reply.is_busy

    def note(self, flag: str) -> None:
        """A flag was seen, in a reply or in an alert."""
        if flag and not is_harmless(flag) and flag not in self.against:
            self.against = (*self.against, flag)
            self.is_homed = self.is_homed and not costs_reference(flag)

    def steps(self) -> int:
        """Position in microsteps, the same in two readings one after the other.

        Raises:
            DeviceProtocolError: three different readings. DeviceLost, DeviceTimeout.
        """
        readings = [int(self.talk.value("pos", WHOLE)) for _ in range(2)]
        if readings[0] != readings[1]:
            readings.append(int(self.talk.value("pos", WHOLE)))
        if readings[-1] != readings[-2]:
            raise DeviceProtocolError(
                f"the mirror tells {readings[0]}, {readings[1]} and {readings[2]} steps at rest",
                subject="mirror",
                remedy="check its cable",
            )
        return readings[-1]

    def begin(self) -> None:
        """A motion is asked for: from here on a `stop` ends it, also before it is given."""
        self._is_stop_asked = False

    def home(self, timeout_s: float) -> None:
        """Find the reference position, from which it counts; errors as of `move`."""
        self.is_homed = False
        self._run(_HOME, self.talk.ask, timeout_s, "finding its home position")
        # What the flags said on the way there does not count any more.
        self.is_homed, self.against = True, ()
        self._require_clear("homing")
        if (found := self.steps()) != 0:
            self.is_homed = False
            raise DeviceProtocolError(
                f"the mirror counts {found} steps at its home position",
                subject="mirror",
                remedy="home it again; a stage that does not count from 0 cannot be used",
            )

    def move(self, command: str, limit_s: float, *, is_repeatable: bool) -> None:
        """Give a motion command, after `begin`, and follow it to its end.

        Args:
            command: without address.
            limit_s: how long it may take; then it is stopped.
            is_repeatable: given twice it does no more than given once.

        Raises:
            UnsupportedControl: rejected; the reason is named.
            DeviceError: stalled, stopped, turned by hand; the flags are named.
            DeviceTimeout: not there in time. DeviceLost, DeviceProtocolError.
        """
        self.against = INTERRUPTED
        self._run(command, self.talk.ask if is_repeatable else self.talk.give, limit_s, "moving")
        self.against = ()
        self._require_clear("moving")

    def stop(self) -> None:
        """Stop moving, now; a motion that another thread has begun then raises."""
        self._is_stop_asked = True
        self.talk.ask("stop")

    def _run(self, command: str, give: Callable[[str], Reply], limit_s: float, what: str) -> None:
        """Give a motion command and follow it; one that cannot be followed is stopped."""
        try:
            # A command that is refused leaves the device what speaks against its reference.
            if self.is_homed:
                self.talk.ask(_CLEAR)
            self._tell(command, give, what)
            if command == _HOME:
                self.talk.ask(_CLEAR)
            self._wait_until_idle(limit_s, what)
        except BaseException:
            with suppress(DeviceError):
                self.talk.ask("stop")
            raise

    def _tell(self, command: str, give: Callable[[str], Reply], what: str) -> None:
        """Give a motion command, again while it is refused for now."""
        deadline_ns = self.talk.line.deadline_ns(_RETRY_S)
        while not (reply := self._give(command, give, what)).is_accepted:
            if reply.data not in _LATER or self._clock.now_ns() >= deadline_ns:
                raise make_rejection(command, reply.data)
            self._clock.wait_until_ns(self._clock.now_ns() + _RETRY_NS)

    def _give(self, command: str, give: Callable[[str], Reply], what: str) -> Reply:
        # Under the lock a stop is either seen here or reaches the device after the command.
        with self.talk.line.lock:
            self._require_unstopped(what)
            return give(command)

    def _require_unstopped(self, what: str) -> None:
        if self._is_stop_asked:
            raise DeviceError(f"the mirror was stopped while {what}", subject="mirror")

    def _wait_until_idle(self, timeout_s: float, what: str) -> None:
        deadline_ns = self.talk.line.deadline_ns(timeout_s)
        while self.talk.ask("").is_busy:
            if self._clock.now_ns() >= deadline_ns:
                raise DeviceTimeout(
                    f"the mirror was still {what} after {timeout_s:.1f} s and was stopped",
                    subject="mirror",
                    remedy="see whether something is in its way, then home it",
                )
            self._clock.wait_until_ns(self._clock.now_ns() + _POLL_NS)
        self._require_unstopped(what)

    def _require_clear(self, what: str) -> None:
        """Raise unless a motion ended without a flag that speaks against it."""
        self.look()
        if self.against:
            raise DeviceError(
                f"{what} the mirror failed: {describe(self.against)}",
                subject="mirror",
                remedy="see what is in its way, then home it",
            )

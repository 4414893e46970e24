"""Projector and mirror are asked in threads of their own: no frame waits for a serial line."""

import threading
import time
from collections import deque
from collections.abc import Callable

from drivers.clock import Clock, SystemClock
from navapp.control.backoff import Backoff
from navapp.control.commands import PROJECTOR_SETTINGS
from navapp.control.device_handlers import (
    DeviceHandler,
    DeviceReport,
    MirrorHandler,
    ProjectorHandler,
)
from navapp.control.session import Session
from navapp.control.states import (
    DeviceHealth,
    DeviceLine,
    EventLevel,
    Snapshot,
)
from navapp.errors import DeviceError

# Between two questions, and after which an answer that was not renewed counts no more. A mirror
# that somebody turns is noticed within half a second; a projector takes 1.5 s to tell everything.
MIRROR_TIMES_S = (0.2, 1.5)
PROJECTOR_TIMES_S = (3.0, 20.0)
_PAUSES_S = (1.0, 8.0)
# A projector takes 9 s to be found silent.
_LONGEST_END_S, _STOP_PERIOD_S = 20.0, 0.1

Deed = Callable[[], str]

_FAILED = (DeviceHealth.TROUBLE, DeviceHealth.LOST)


class DeviceMonitor:
    """The newest report of one device; a lost one is opened again, with growing pauses.

    The first report is made at once. A device that is not slow is asked for every report; a slow
    one by a thread, and what that thread has not renewed in time counts as lost.
    """

    def __init__(
        self, handler: DeviceHandler, times_s: tuple[float, float], clock: Clock | None = None
    ) -> None:
        """Make the first report.

        Args:
            handler: of the device.
            times_s: between two questions; after which a report is stale.
            clock: of the reports' age.
        """
        self._handler = handler
        self._period_s, self._stale_s = times_s
        self._clock: Clock = clock or SystemClock()
        self._backoff = Backoff(*_PAUSES_S)
        self._wake = threading.Event()
        self._is_over = False
        self._n_asked = self._n_restored = 0
        self._deeds: deque[tuple[str, Deed]] = deque()
        self._answers: deque[tuple[str, EventLevel]] = deque()
        self._made = (self._clock.now_ns(), handler.report())
        self._thread: threading.Thread | None = None
        if handler.is_slow:
            self._thread = threading.Thread(target=self._run, name="device watch", daemon=True)
            self._thread.start()

    @property
    def report(self) -> DeviceReport:
        """The newest."""
        if self._thread is None:
            return self._handler.report()
        made_ns, report = self._made
        if self._is_restoring and self._handler.restoring:
            return self._with(report, DeviceHealth.TROUBLE, self._handler.restoring)
        is_lost = report.line.health is DeviceHealth.LOST
        if not is_lost and self._clock.now_ns() - made_ns > self._stale_s * 1e9:
            return self._with(report, DeviceHealth.LOST, "has not answered for a while")
        return report

    def restore(self) -> None:
        """Open it if it is lost, and bring it to its place: now, without the pause."""
        self._n_asked += 1
        self._wake.set()

    def do(self, what: str, deed: Deed) -> None:
        """Have something done between two questions; `pop_answers` tells what became of it."""
        self._deeds.append((what, deed))
        if self._thread is None:
            self._do_deeds()
        self._wake.set()

    def pop_answers(self) -> list[tuple[str, EventLevel]]:
        """What became of deeds, each once."""
        return [self._answers.popleft() for _ in range(len(self._answers))]

    def _do_deeds(self) -> None:
        while self._deeds:
            what, deed = self._deeds.popleft()
            try:
                self._answers.append((f"{what}: {deed()}", EventLevel.INFO))
            except DeviceError as error:
                self._answers.append((f"{what} failed: {error}", EventLevel.WARNING))

    def _lose(self, report: DeviceReport, why: str) -> DeviceReport:
        """What was asked of a device that is lost must not happen minutes later."""
        while self._deeds:
            what, _ = self._deeds.popleft()
            self._answers.append((f"{what} failed: it is not there", EventLevel.WARNING))
        return self._with(report, DeviceHealth.LOST, why)

    @property
    def _is_restoring(self) -> bool:
        return self._n_restored < self._n_asked

    def close(self) -> None:
        """End the thread, and what the device does."""
        self._is_over = True
        self._wake.set()
        end_s = time.monotonic() + _LONGEST_END_S
        # A motion may be about to begin: one stop could come just before it.
        while self._thread is not None and self._thread.is_alive() and time.monotonic() < end_s:
            self._handler.stop()
            self._thread.join(_STOP_PERIOD_S)

    def _run(self) -> None:
        pause_s = self._period_s
        while True:
            self._wake.wait(pause_s)
            self._wake.clear()
            if self._is_over:
                return
            report = self._ask()
            self._made = (self._clock.now_ns(), report)
            if report.line.health is DeviceHealth.LOST:
                pause_s = self._backoff.next_pause_s()
            else:
                self._backoff.reset()
                pause_s = self._period_s

    def _ask(self) -> DeviceReport:
        n_asked, report = self._n_asked, self._made[1]
        try:
            if report.line.health is DeviceHealth.LOST:
                self._handler.reopen()
            if self._is_restoring:
                self._handler.restore()
            self._do_deeds()
            return self._handler.report()
        except DeviceError as error:
            return self._lose(report, str(error))
        except Exception as error:  # noqa: BLE001 (a bug must end as a lost device, not as a silent thread)
            return self._lose(report, f"failed: {error!r}")
        finally:
            self._n_restored = n_asked

    def _with(self, report: DeviceReport, health: DeviceHealth, detail: str) -> DeviceReport:
        line = report.line
        return DeviceReport(DeviceLine(line.kind, line.name, health, detail), self._handler.reason)


class MonitoredDevices:
    """The session's projector and mirror.

    The mirror is brought to its calibrated angle when the session begins.
    """

    def __init__(self, projector: ProjectorHandler, mirror: MirrorHandler) -> None:
        self._projector = projector
        self._watches = (
            DeviceMonitor(projector, PROJECTOR_TIMES_S),
            DeviceMonitor(mirror, MIRROR_TIMES_S),
        )
        self.restore()

    @property
    def reports(self) -> tuple[DeviceReport, ...]:
        """Of the projector and of the mirror."""
        return tuple(watch.report for watch in self._watches)

    def restore(self) -> None:
        """Open what is lost and bring the mirror to its place, now."""
        for watch in self._watches:
            watch.restore()

    def set_projector(self, name: str) -> None:
        """Have one of `PROJECTOR_SETTINGS` told to the projector."""
        what = f"projector, {PROJECTOR_SETTINGS[name]}"
        self._watches[0].do(what, lambda: self._projector.set(name))

    def tell_answers(self, session: Session) -> None:
        """What became of it, as events."""
        for text, level in self._watches[0].pop_answers():
            session.add_event("projector", text, level)

    def close(self) -> None:
        """End all watching, the mirror's first: it may move; the devices stay open."""
        for watch in reversed(self._watches):
            watch.close()


def tell_changes(session: Session, before: Snapshot, after: Snapshot) -> None:
    """Say once what projector or mirror has begun, or has ceased, to have against guides."""
    for reason in after.device_reasons:
        if reason not in before.device_reasons:
            details = "; ".join(line.detail for line in after.devices if line.health in _FAILED)
            session.add_event("device", f"dark: {reason.value} ({details})", EventLevel.ALARM)
    for reason in before.device_reasons:
        if reason not in after.device_reasons:
            session.add_event("device", f"no longer: {reason.value}")

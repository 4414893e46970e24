"""The events of a session, and who is told of them."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from drivers.clock import Clock
from navapp.control.camera_link import Reopen
from navapp.control.commands import Command
from navapp.control.frame_result import FrameListener, FrameResult
from navapp.control.recorder import RecordingStopped, SessionRecorder
from navapp.control.states import Event, EventLevel
from navapp.errors import UsageError

_EVENTS_SHOWN = 60


@dataclass(frozen=True, slots=True)
class SessionHooks:
    """Who is told what; all called from the thread that steps the controller."""

    on_frame: tuple[FrameListener, ...] = ()
    on_event: tuple[Callable[[Event], None], ...] = ()
    on_command: tuple[Callable[[Command, int], None], ...] = ()
    on_take_over: tuple[Callable[[int], None], ...] = ()
    on_other_take_over: tuple[Callable[[int], None], ...] = ()
    on_stage: tuple[Callable[[str], None], ...] = ()
    reopen_camera: Reopen | None = None
    recorder: SessionRecorder | None = None  # that is told; None: nothing is kept


class EventLog:
    """Keeps the newest events and tells the hooks.

    Args:
        clock: of the session.
        hooks: who is told.
    """

    def __init__(self, clock: Clock, hooks: SessionHooks) -> None:
        self._clock = clock
        self._hooks = hooks
        self._events: deque[Event] = deque(maxlen=_EVENTS_SHOWN)
        self._sequence = -1

    @property
    def sequence(self) -> int:
        """Of the newest handled frame, -1 before the first."""
        return self._sequence

    @property
    def events(self) -> tuple[Event, ...]:
        """The newest, oldest first."""
        return tuple(self._events)

    def add(self, kind: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """Keep and tell what has just happened."""
        event = Event(self._clock.now_ns(), kind, text, level, self._sequence)
        self._events.append(event)
        self._tell(self._hooks.on_event, event)

    def begin_frame(self, sequence: int) -> None:
        """What happens from now on happens after that frame."""
        self._sequence = sequence

    def tell_frame(self, result: FrameResult) -> None:
        """A frame was handled."""
        self._tell(self._hooks.on_frame, result)

    def tell_command(self, command: Command) -> None:
        """A command is about to be handled."""
        self._tell(self._hooks.on_command, command, self._sequence)

    def tell_take_over(self, next_sequence: int) -> None:
        """A registration's result is used from that frame on."""
        self._tell(self._hooks.on_take_over, next_sequence)

    def tell_other_take_over(self, sequence: int) -> None:
        """What a search for another bone has found is used in that frame."""
        self._tell(self._hooks.on_other_take_over, sequence)

    def tell_stage(self, name: str) -> None:
        """Tell the simulated room, if any; a stage that it cannot show is an event."""
        for listener in self._hooks.on_stage:
            try:
                listener(name)
            except UsageError as error:
                self.add("stage", str(error), EventLevel.WARNING)

    def _tell(self, listeners: tuple[Callable[..., None], ...], *words: object) -> None:
        """Tell all; a recording that cannot go on is an event, not the end of the session."""
        for listener in listeners:
            try:
                listener(*words)
            except RecordingStopped as error:
                self.add("recording", str(error), EventLevel.ALARM)

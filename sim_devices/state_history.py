"""The states of an operation, and between which pictures they changed."""

import threading

from sim_devices.operation import State


class StateHistory:
    """States in the order in which they were shown; usable from several threads.

    A pose of an earlier picture is asked for, too, when the room is in another state already.

    Args:
        first: that is shown before any other.
    """

    def __init__(self, first: State) -> None:
        self._lock = threading.Lock()
        # Each with the time (ns) of the newest picture before it.
        self._shown: list[tuple[int, State]] = [(-1, first)]
        self._newest_ns = -1

    @property
    def now(self) -> State:
        """The one in force."""
        return self._shown[-1][1]

    def show(self, state: State) -> None:
        """Put a state in force from the next picture on."""
        with self._lock:
            self._shown.append((self._newest_ns, state))

    def take_picture(self, time_ns: int) -> State:
        """The state in force, which a picture of that time shows."""
        with self._lock:
            self._newest_ns = max(self._newest_ns, time_ns)
            return self.now

    def at(self, time_ns: int) -> State:
        """The state that a picture of that time has shown, or would show."""
        for before_ns, state in reversed(self._shown):
            if before_ns < time_ns:
                return state
        return self._shown[0][1]

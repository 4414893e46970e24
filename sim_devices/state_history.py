"""The states of an operation as the room shows them: set from outside, kept for earlier pictures.

It knows names of steps and no places: nothing here is truth.
"""

import threading

from sim_devices.operation import STEPS, State, enter


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
    def names(self) -> frozenset[str]:
        """Of all steps that can be made."""
        return frozenset(step.name for step in STEPS)

    def set_stage(self, name: str) -> frozenset[str]:
        """Show a stage from the next picture on, as it is usually entered.

        Returns:
            Names of all steps that are made then.

        Raises:
            UsageError: there is no such stage.
        """
        return self.show(enter(name))

    def go_on(self, name: str) -> frozenset[str]:
        """Show another stage as far as it was made, after all that comes before; as `set_stage`."""
        return self.show(self.now.go_on(name))

    def make(self, step: str) -> None:
        """Show a step as made.

        Raises:
            UsageError: the operation has no such step.
        """
        self.show(State(self.now.stage, self.now.made | {step}))

    def unmake(self, step: str) -> None:
        """Show a step as not made."""
        self.show(State(self.now.stage, self.now.made - {step}))

    @property
    def now(self) -> State:
        """The one in force."""
        return self._shown[-1][1]

    def show(self, state: State) -> frozenset[str]:
        """Put a state in force from the next picture on; what is made in it."""
        with self._lock:
            self._shown.append((self._newest_ns, state))
        return state.made

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

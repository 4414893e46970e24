"""The practice room makes what an operator confirms, and tells what it shows as made."""

from collections.abc import Callable, Collection, Mapping
from typing import Protocol

import numpy as np

from navapp.control.commands import Command, ConfirmStep, ReadThickness, WithdrawStep
from navapp.errors import UsageError
from navapp.geometry.transform import FloatArray
from navapp.resection import list_caliper_points, needs_caliper
from navapp.values import Plan


class Room(Protocol):
    """A simulated room as far as steps go: their names, no planes and no poses."""

    def set_stage(self, name: str, /) -> frozenset[str]:
        """Show a stage as it is usually entered; answers with all steps that are made then."""
        ...

    def go_on(self, name: str, /) -> frozenset[str]:
        """Show another stage as far as it was made, and what comes before it; the same answer."""
        ...

    def make(self, step: str, /) -> None:
        """Show a step as made."""
        ...

    def unmake(self, step: str, /) -> None:
        """Show it as not made."""
        ...


class Caliper(Protocol):
    """A simulated caliper."""

    def read(self, cut: str, points_mm: FloatArray, normal: FloatArray, /) -> FloatArray:
        """(N,) mm of bone below points (N, 3) of a cut, along its planned normal (3,); else NaN."""
        ...


def read_thicknesses(
    plan: Plan, caliper: Caliper, names: Collection[str]
) -> dict[str, tuple[float, ...]]:
    """What a person would read (mm) below those of the plan's cuts that need it, once made."""
    read = {}
    for name in sorted(names):
        step = plan.content.steps[name]
        if not needs_caliper(step):
            continue
        try:
            points = list_caliper_points(plan.bones[step.bone], step)
        except UsageError:  # the plan's cut allows no reading
            continue
        points_mm = step.point_mm + np.array([one.place_mm for one in points]) @ step.axes
        read_mm = caliper.read(name, points_mm, step.normal)
        # NaN where the jaws find no bone: a person reads nothing then.
        if np.isfinite(read_mm).all():
            # A caliper shows hundredths.
            read[name] = tuple(round(float(one), 2) for one in read_mm)
    return read


class PracticeSteps:
    """Keeps what a session has confirmed and what the simulated room shows the same.

    A session begins as its stage is usually entered. Then the operator makes the steps: one that
    is confirmed is made in the room, one that is withdrawn is undone. A stage that is entered later
    is shown as far as it was made, with all that comes before it and nothing of later ones. Where
    the thickness of what is left must be read, that is done as well. What changes by that goes
    through the session's queue as commands, so that a recording holds it.

    Args:
        room: that is shown.
        shared: names of the steps that both the session's plan and the room have.
        thickness_mm: what a caliper reads below cuts, by name; of those that need it.
    """

    def __init__(
        self,
        room: Room,
        shared: Collection[str],
        thickness_mm: Mapping[str, tuple[float, ...]] | None = None,
    ) -> None:
        self._room, self._shared = room, frozenset(shared)
        # Read beforehand: nothing here leads to the room's truth.
        self._thickness_mm = thickness_mm or {}
        self._submit: Callable[[Command], None] | None = None
        self._is_begun = False
        # In the room; and what the session knows of it.
        self._shown: frozenset[str] = frozenset()
        self._told: frozenset[str] = frozenset()
        # Confirmed; who confirms one again is refused, and reads nothing.
        self._confirmed: set[str] = set()

    def enter_stage(self, name: str) -> None:
        """The session is in another stage, or in its first one.

        Raises:
            UsageError: the room cannot show it.
        """
        show = self._room.go_on if self._is_begun else self._room.set_stage
        self._is_begun, self._shown = True, show(name)
        self._tell()

    def connect(self, submit: Callable[[Command], None]) -> None:
        """From now on the session takes commands; it is told what it does not know yet."""
        self._submit = submit
        self._tell()

    def on_command(self, command: Command, after_sequence: int) -> None:
        """The session is about to handle a command."""
        match command:
            case ConfirmStep(name) if name in self._shared:
                if name not in self._shown:
                    self._room.make(name)
                self._shown, self._told = self._shown | {name}, self._told | {name}
                is_new = name not in self._confirmed
                if self._submit is not None and is_new and name in self._thickness_mm:
                    self._submit(ReadThickness(name, self._thickness_mm[name]))
                self._confirmed.add(name)
            case WithdrawStep(name):
                self._confirmed.discard(name)
                if name in self._shown:
                    self._room.unmake(name)
                    self._shown, self._told = self._shown - {name}, self._told - {name}

    def _tell(self) -> None:
        if self._submit is None:
            return
        shown = self._shown & self._shared
        for name in sorted(self._told - shown):
            self._submit(WithdrawStep(name))
        for name in sorted(shown - self._told):
            self._submit(ConfirmStep(name))
        self._told = shown

"""The cuts that the practice room shows as made, told to the session as an operator tells them."""

from collections.abc import Callable, Collection

from navapp.control.commands import Command, ConfirmCut, WithdrawCut


class PracticeCuts:
    """Keeps a session's confirmed cuts those of the simulated room.

    The room says names of planned cuts, no planes and no poses. They go through the session's
    queue as commands, so that a recording holds them.

    Args:
        set_stage: tells the room which stage is in force; answers with the cuts made there.
        planned: names of the planes of the session's plan, which may not be the room's.
    """

    def __init__(
        self, set_stage: Callable[[str], tuple[str, ...]], planned: Collection[str]
    ) -> None:
        self._set_stage = set_stage
        self._planned = planned
        self._submit: Callable[[Command], None] | None = None
        self._shown: tuple[str, ...] = ()
        self._told: tuple[str, ...] = ()

    def enter_stage(self, name: str) -> None:
        """The session is in another stage.

        Raises:
            UsageError: the room cannot show it.
        """
        self._shown = tuple(cut for cut in self._set_stage(name) if cut in self._planned)
        self._tell()

    def connect(self, submit: Callable[[Command], None]) -> None:
        """From now on the session takes commands; it is told what it does not know yet."""
        self._submit = submit
        self._tell()

    def _tell(self) -> None:
        if self._submit is None:
            return
        for name in self._told:
            if name not in self._shown:
                self._submit(WithdrawCut(name))
        for name in self._shown:
            if name not in self._told:
                self._submit(ConfirmCut(name))
        self._told = self._shown

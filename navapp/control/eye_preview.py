"""The operator's picture of what an eye sees in a simulated mirror, for showing only."""

from dataclasses import dataclass

from drivers.frames import Image
from navapp.control.executors import Executor, Job
from navapp.values.pictures import Look

# From one look to the next, at least; a look that was begun longer ago is not shown.
_PERIOD_NS = 250_000_000
_VALID_NS = 4 * _PERIOD_NS


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Pictures of one look."""

    picture: Image
    plain: Image  # without the display's light
    begun_ns: int  # before that the display was not looked at
    has_guides: bool  # the display showed guides at some time during the look


class EyePreview:
    """Looks through the eye while it is switched on, a few times a second, one look at a time.

    Args:
        look: of the eye; None: there is none.
        executor: runs the looks; closed with the preview.

    Attributes:
        is_on: the operator wants to see it.
    """

    def __init__(self, look: Look | None, executor: Executor) -> None:
        self._look, self._executor = look, executor
        self._job: Job[tuple[Image, Image]] | None = None
        self._begun_ns = self._due_ns = 0
        # While the job runs: guides were shown, and its pictures are still wanted.
        self._had_guides = self._is_wanted = False
        self._seen: _Seen | None = None
        self.is_on = False

    @property
    def is_possible(self) -> bool:
        """There is an eye to look through."""
        return self._look is not None

    def toggle(self) -> None:
        """Show it, or no longer."""
        self.is_on = not self.is_on
        self._forget()

    def update(
        self, now_ns: int, *, has_guides: bool, is_hidden: bool = False
    ) -> tuple[Image, Image | None] | None:
        """The newest pictures (H, W, 3), with guides and without; None without any.

        None as well when the newest look was begun too long ago. A bug in the look is not hidden:
        it is raised.

        Args:
            now_ns: on the session's clock.
            has_guides: the display shows guides now; without them, none that it showed are seen.
            is_hidden: the screen shows something else now; what was seen before is forgotten.
        """
        look = self._look
        if look is None or not self.is_on or is_hidden:
            self._forget()
            return None
        if self._job is None and now_ns >= self._due_ns:
            self._begun_ns, self._due_ns = now_ns, now_ns + _PERIOD_NS
            self._had_guides, self._is_wanted = False, True
            self._job = Job(lambda report: look())
            self._executor.start(self._job)
        self._had_guides |= has_guides
        self._take_over()
        seen = self._seen
        if seen is None or now_ns - seen.begun_ns > _VALID_NS:
            return None
        if has_guides:
            return seen.picture, seen.plain
        return seen.plain if seen.has_guides else seen.picture, None

    def close(self) -> None:
        """Wait for a look that still runs."""
        self._executor.close()

    def _forget(self) -> None:
        """What was seen, and what a look that still runs will see."""
        self._seen, self._due_ns, self._is_wanted = None, 0, False

    def _take_over(self) -> None:
        job = self._job
        if job is None or not job.is_finished:
            return
        self._job = None
        if job.error is not None:
            raise job.error
        if self._is_wanted and job.result is not None:
            self._seen = _Seen(*job.result, self._begun_ns, self._had_guides)

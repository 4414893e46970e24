"""The operator's small picture of what an eye sees in a simulated mirror, for showing only."""

from dataclasses import dataclass

from drivers.frames import Image
from navapp.control.executors import Executor, Job
from navapp.overlay import make_preview
from navapp.values.pictures import Look

# From one look to the next, at least.
_PERIOD_NS = 250_000_000


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Small pictures of one look."""

    picture: Image
    plain: Image  # without the display's light
    has_guides: bool  # the display showed guides, or was about to, when the eye began to look


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
        self._job: Job[_Seen] | None = None
        self._due_ns = 0
        self._seen: _Seen | None = None
        self.is_on = False

    @property
    def is_possible(self) -> bool:
        """There is an eye to look through."""
        return self._look is not None

    def toggle(self) -> None:
        """Show it, or no longer."""
        self.is_on = not self.is_on
        self._seen, self._due_ns = None, 0

    def update(self, now_ns: int, *, has_guides: bool) -> tuple[Image, Image | None] | None:
        """The newest small pictures (h, w, 3), with guides and without; None without any.

        A bug in the look is not hidden: it is raised.

        Args:
            now_ns: on the session's clock.
            has_guides: the display shows guides now; without them, none that it showed are seen.
        """
        look = self._look
        if look is None or not self.is_on:
            return None
        if self._job is None and now_ns >= self._due_ns:
            self._due_ns = now_ns + _PERIOD_NS
            self._job = Job(lambda report: _look_through(look, has_guides))
            self._executor.start(self._job)
        self._take_over()
        seen = self._seen
        if seen is None:
            return None
        if has_guides:
            return seen.picture, seen.plain
        return seen.plain if seen.has_guides else seen.picture, None

    def close(self) -> None:
        """Wait for a look that still runs."""
        self._executor.close()

    def _take_over(self) -> None:
        job = self._job
        if job is None or not job.is_finished:
            return
        self._job = None
        if job.error is not None:
            raise job.error
        self._seen = job.result


def _look_through(look: Look, has_guides: bool) -> _Seen:
    picture, plain = look()
    return _Seen(make_preview(picture), make_preview(plain), has_guides)

"""What a session with a screen has left: its recording, and the log of what libraries printed."""

from dataclasses import dataclass
from pathlib import Path

from navapp.cli.diagnostics import Diagnostics


@dataclass(frozen=True, slots=True)
class KeptFiles:
    """Where a session keeps things; made before it begins.

    Args:
        recording: folder; None: the session is not recorded.
        log: file.
        log_bytes: that it held before.
    """

    recording: Path | None
    log: Path
    log_bytes: int

    @classmethod
    def begin(cls, recording: str | None, log: Path) -> "KeptFiles":
        """Before the session."""
        return cls(None if recording is None else Path(recording), log, _size_of(log))

    def tell(self, n_frames: int, *, is_whole: bool, diagnostics: Diagnostics) -> None:
        """Say what is there now.

        Args:
            n_frames: that were handled.
            is_whole: the recording was not stopped early.
            diagnostics: takes it.
        """
        if self.recording is not None and not self.recording.is_dir():
            diagnostics.warn(f"no frame came, {self.recording} was not kept")
        elif self.recording is not None:
            size = sum(_size_of(file) for file in self.recording.rglob("*"))
            frames = f"{n_frames} frames, " if is_whole else ""
            diagnostics.say(
                f"recorded session: {self.recording} ({frames}{size / 1e6:.0f} MB); "
                f"navapp replay {self.recording} shows it again"
            )
            if not is_whole:
                diagnostics.warn("the recording was stopped before the session's end")
        if _size_of(self.log) > self.log_bytes:
            diagnostics.say(f"messages of libraries: {self.log}")


def _size_of(file: Path) -> int:
    try:
        return file.stat().st_size if file.is_file() else 0
    except OSError:
        return 0

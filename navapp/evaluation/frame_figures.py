"""Figures of a set of frames: how many are OK, how far off they are, how often bounds hold."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from navapp.evaluation.methods import OURS
from navapp.evaluation.scores import FrameScore


@dataclass(frozen=True, slots=True, eq=False)
class FrameFigures:
    """Figures of some frames; None where no frame has the figure."""

    frames: tuple[FrameScore, ...]

    @property
    def n_frames(self) -> int:
        """All of them."""
        return len(self.frames)

    @property
    def n_ok(self) -> int:
        """Frames that the judge calls OK."""
        return sum(frame.is_ok for frame in self.frames)

    @property
    def ok_share(self) -> float:
        """Share of OK frames; 0 of none."""
        return self.n_ok / max(self.n_frames, 1)

    @property
    def n_wrong(self) -> int:
        """Frames that are OK, more than 1 mm off and beyond their bound."""
        return sum(frame.is_wrong for frame in self.frames)

    @property
    def with_error(self) -> "FrameFigures":
        """Frames with a pose and a known truth."""
        return FrameFigures(tuple(frame for frame in self.frames if frame.tre_mm is not None))

    @property
    def ok(self) -> "FrameFigures":
        """OK frames with a known truth."""
        return FrameFigures(tuple(one for one in self.with_error.frames if one.is_ok))

    @property
    def refused(self) -> "FrameFigures":
        """Frames that the judge does not call OK."""
        return FrameFigures(tuple(frame for frame in self.frames if not frame.is_ok))

    @property
    def errors_mm(self) -> list[float]:
        """TRE of each frame that has one."""
        return [frame.tre_mm for frame in self.frames if frame.tre_mm is not None]

    @property
    def mean_mm(self) -> float | None:
        """Mean TRE."""
        return find_mean(self.errors_mm)

    @property
    def worst_mm(self) -> float | None:
        """Largest TRE."""
        return max(self.errors_mm, default=None)

    def percentile_mm(self, percent: float) -> float | None:
        """TRE that so many of 100 frames stay below."""
        return find_percentile(self.errors_mm, percent)

    def select_counted(self, method: str) -> "FrameFigures":
        """Frames whose errors count: OK ones for ours, all with an error for the paper's methods.

        Our judge is not made for the paper's methods.
        """
        return self.ok if method == OURS else self.with_error

    @property
    def mean_displacement_mm(self) -> float | None:
        """Mean overlay error."""
        return find_mean(frame.displacement_mm for frame in self.frames)

    @property
    def mean_outline_mm(self) -> float | None:
        """Mean distance of the outlines."""
        return find_mean(frame.outline_mm for frame in self.frames)

    @property
    def bound_coverage(self) -> float | None:
        """Of OK frames with a known truth, the share within their bound."""
        return find_mean(float(frame.is_within_bound) for frame in self.ok.frames)


def pool_frames(parts: Iterable[Sequence[FrameScore]]) -> FrameFigures:
    """The frames of several tests together."""
    return FrameFigures(tuple(frame for part in parts for frame in part))


def find_mean(values: Iterable[float | None]) -> float | None:
    """Mean of the known values; None without any."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def find_percentile(values: Sequence[float], percent: float) -> float | None:
    """The value that so many of 100 stay below; None without any."""
    return float(np.percentile(values, percent)) if values else None


def find_rate_hz(times_ms: Sequence[float]) -> float | None:
    """One over the mean time of a frame; None without any."""
    mean_ms = find_mean(times_ms)
    return None if mean_ms is None else 1e3 / mean_ms

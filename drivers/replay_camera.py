"""A stereo camera that hands out recorded frames."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from drivers.clock import Clock
from drivers.frames import FrameMeter, Image, StereoFrame
from drivers.interfaces import CameraInfo
from drivers.recorded_sources import RecordedSource, open_folder
from drivers.recorded_videos import StereoVideo
from navapp.errors import (
    DeviceLost,
    EndOfSequence,
    SequenceError,
    UnsupportedControl,
    UsageError,
)

Order = Literal["forward", "pingpong"]


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Order, range and rate of a replay.

    Raises:
        UsageError: settings that mean nothing.
    """

    # `pingpong` walks 0 1 2 1 0 1 ..., and without `n_frames` there and back once.
    order: Order = "forward"
    n_frames: int | None = None  # at most so many
    start: int = 0  # frames with a smaller number are left out
    rate_hz: float = 15.0  # where the source has neither times nor a rate
    is_side_by_side: bool = False  # each picture of the one video holds both eyes

    def __post_init__(self) -> None:
        if self.order not in get_args(Order):
            raise UsageError(f"unknown order {self.order!r}", remedy="use forward or pingpong")
        if self.n_frames is not None and self.n_frames < 1:
            raise UsageError(
                f"{self.n_frames} frames cannot be replayed", remedy="ask for at least 1"
            )
        if not (math.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise UsageError(f"a rate of {self.rate_hz:g} Hz is none", remedy="use a positive rate")


class ReplayCamera:
    """Steps through a folder of pairs, a session folder or videos; moves the clock along.

    Capture times are the recorded ones, else multiples of the frame period from 0 in the order of
    reading; walking backwards, time still runs forwards, by the same intervals. Opening again
    starts again.
    """

    def __init__(
        self,
        source: str | Path,
        clock: Clock,
        settings: ReplaySettings = ReplaySettings(),
        *,
        rig_id: str = "",
        row_delay_ns: int = 0,
    ) -> None:
        """Set up; nothing is read before `open`.

        Args:
            source: folder, two videos `LEFT,RIGHT`, or one video to be split.
            clock: moved to each capture time.
            settings: how it is walked through.
            rig_id: of the rig that took the pictures.
            row_delay_ns: of that rig.
        """
        self._source_name = str(source)
        self._clock = clock
        self._settings = settings
        self._rig_id, self._row_delay_ns = rig_id, row_delay_ns
        self._source: RecordedSource | None = None
        self._places: Iterator[int] = iter(())
        self._size = (0, 0)
        self._length: int | None = None
        self._last: StereoFrame | None = None
        self._last_place = 0
        self._n_read = 0
        self._meter = FrameMeter()

    @property
    def info(self) -> CameraInfo:
        """Size and length are known once it was opened."""
        return CameraInfo(
            name=f"replay:{Path(self._source_name).name}",
            backend="replay",
            is_simulated=False,
            is_stepped=True,
            width=self._size[0],
            height=self._size[1],
            measured_rate_hz=self._meter.rate_hz,
            measured_skew_ms=self._meter.skew_ms,
            n_frames=self._length,
        )

    def open(self) -> None:
        """Find all pairs and decode the first.

        Raises:
            SequenceError: nothing there, unpaired, damaged.
            UsageError: a video that needs a partner, a split of something that is no video.
        """
        if self._source is not None:
            return
        source = open_source(self._source_name, self._settings.is_side_by_side)
        try:
            places = self._places_of(source)
            left, _ = self._load_pair(source, places[0])
        except BaseException:
            source.close()
            raise
        self._size = (left.shape[1], left.shape[0])
        self._length = self._length_of(len(places))
        self._places = itertools.islice(_walk(places, self._settings.order), self._length)
        self._last, self._n_read, self._meter = None, 0, FrameMeter()
        self._source = source

    def read(self, timeout_s: float) -> StereoFrame:
        """Load the next pair, however long that takes.

        Raises:
            SequenceError: a picture is damaged, or differs from the first in size.
            DeviceLost, EndOfSequence: see `StereoCamera.read`.
        """
        if self._source is None:
            raise DeviceLost(
                f"the recording {self._source_name} is not open",
                subject=self._source_name,
                remedy="open it before reading",
            )
        place = next(self._places, None)
        if place is None:
            raise EndOfSequence(f"{self._source_name} ended", subject=self._source_name)
        left, right = self._load_pair(self._source, place)
        if (left.shape[1], left.shape[0]) != self._size:
            raise SequenceError(
                f"pair {self._source.numbers[place]} of {self._source_name} differs in size from "
                f"the first: {left.shape[1]}x{left.shape[0]} against "
                f"{self._size[0]}x{self._size[1]}",
                subject=self._source_name,
                remedy="remove it, or replay the sizes as sequences of their own",
            )
        captured_ns, skew_ns = self._times(self._source, place)
        self._clock.wait_until_ns(captured_ns)
        self._last = StereoFrame(
            left,
            right,
            captured_ns,
            max(captured_ns, self._clock.now_ns()),
            skew_ns,
            sequence=self._sequence(self._source.numbers[place]),
            rig_id=self._rig_id,
            source_index=self._source.numbers[place],
            row_delay_ns=self._row_delay_ns,
        )
        self._last_place = place
        self._n_read += 1
        self._meter.add(self._last)
        return self._last

    def set(self, control: str, value: float) -> float:
        """A recording has no controls."""
        raise UnsupportedControl(
            f"a recording cannot change {control}",
            subject=control,
            remedy="use a live camera",
        )

    def close(self) -> None:
        """Release the source."""
        if self._source is not None:
            self._source.close()
            self._source = None

    def _sequence(self, number: int) -> int:
        """The picture's own number, so that a session's events still name the right frames.

        Walking to and fro numbers repeat: then the frames are counted.
        """
        return number if self._settings.order == "forward" else self._n_read

    def _places_of(self, source: RecordedSource) -> list[int]:
        """Where the frames from the start on are."""
        start = self._settings.start
        places = [place for place, number in enumerate(source.numbers) if number >= start]
        if not places:
            raise SequenceError(
                f"{self._source_name} ends at number {source.numbers[-1]}, before the "
                f"start {start}",
                subject=self._source_name,
                remedy="start earlier",
            )
        return places

    def _length_of(self, n_places: int) -> int:
        """How many frames will be handed out."""
        n_frames = self._settings.n_frames
        if self._settings.order == "pingpong":
            return 2 * n_places - 1 if n_frames is None else n_frames
        return n_places if n_frames is None else min(n_places, n_frames)

    def _load_pair(self, source: RecordedSource, place: int) -> tuple[Image, Image]:
        left, right = source.load(place)
        if left.shape != right.shape:
            raise SequenceError(
                f"left and right of pair {source.numbers[place]} of {self._source_name} differ in "
                f"size or colour: {_size_text(left)} against {_size_text(right)}",
                subject=self._source_name,
                remedy="both pictures of a pair must be alike",
            )
        return left, right

    def _times(self, source: RecordedSource, place: int) -> tuple[int, int]:
        """Capture time and skew in ns of the pair that is read next."""
        period_s = 1.0 / (source.rate_hz or self._settings.rate_hz)
        if source.times is None:
            return round(self._n_read * period_s * 1e9), 0
        times = source.times[place]
        if self._last is None:
            return times.captured_ns, times.skew_ns
        interval_ns = abs(times.captured_ns - source.times[self._last_place].captured_ns)
        if place == self._last_place:  # a single pair, walked again and again
            interval_ns = round(period_s * 1e9)
        return self._last.captured_ns + interval_ns, times.skew_ns


def open_source(source: str, split_side_by_side: bool = False) -> RecordedSource:
    """The recorded pairs behind a path, or behind two paths of videos joined by a comma.

    Raises:
        SequenceError: missing, empty, unpaired or unreadable.
        UsageError: one video without a split, or a split of something else.
    """
    path = Path(source)
    parts = source.split(",")
    if path.exists() and path.is_dir() != split_side_by_side:
        return open_folder(path) if path.is_dir() else StereoVideo([path])
    if path.is_dir() or (len(parts) == 2 and split_side_by_side):
        raise UsageError(
            f"{source} cannot be split side by side: it is not one video", subject=source
        )
    if path.exists():
        raise UsageError(
            f"{source} is one video for two eyes",
            subject=source,
            remedy="give LEFT,RIGHT, or --split side-by-side when it shows both",
        )
    if len(parts) == 2 and all(part.strip() for part in parts):
        return StereoVideo([Path(part.strip()) for part in parts])
    raise SequenceError(
        f"there is no recording {source}",
        subject=source,
        remedy="give a folder of pairs, a session folder, or two videos LEFT,RIGHT",
    )


def _walk(places: list[int], order: Order) -> Iterator[int]:
    """Places in the order of reading; `pingpong` never ends."""
    if order == "forward" or len(places) == 1:
        return iter(places) if order == "forward" else itertools.repeat(places[0])
    return itertools.cycle(places + places[-2:0:-1])


def _size_text(picture: Image) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]} {'grey' if picture.ndim == 2 else 'colour'}"

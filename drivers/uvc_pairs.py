"""The newest pair of pictures of one or two running USB cameras."""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from drivers.clock import Clock
from drivers.frames import Image
from drivers.latest import LatestSlot
from drivers.pairing import PairMatcher, TimedPicture
from drivers.uvc_camera import UvcCamera
from drivers.uvc_reader import UvcReader
from navapp.errors import DeviceLost, DeviceTimeout, UnsupportedControl

# V4L2 gives a stalled camera up after a second; after three such it is lost.
_LOST_AFTER_NS = 3_000_000_000
_JOIN_S = 2.5
_ANSWER_S = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class TimedPair:
    """Two pictures of one instant."""

    # left, right: alike in shape.
    left: Image
    right: Image
    captured_ns: int  # of the left one
    received_ns: int  # when both were there
    skew_ns: int  # right minus left


class UvcPairs:
    """Two cameras with a reader thread each, or one whose pictures hold both eyes side by side.

    Made by one opening of the stereo camera and not used again after `close`.
    """

    def __init__(
        self, cameras: tuple[UvcCamera, ...], clock: Clock, max_skew_ns: int, max_age_ns: int
    ) -> None:
        """Start reading.

        Args:
            cameras: opened, left and right, or the one of both eyes; they belong to this object.
            clock: of the capture times.
            max_skew_ns: greatest skew of a pair, below half of the frame period.
            max_age_ns: a pair that is older when it is taken is dropped.
        """
        self.cameras = cameras
        self._clock = clock
        self._max_age_ns = max_age_ns
        self._matcher = PairMatcher(max_skew_ns)
        self._slot: LatestSlot[TimedPair] = LatestSlot()
        self._n_aged = 0
        self._heard_ns = [clock.now_ns()] * len(cameras)
        self._readers = [
            UvcReader(camera, partial(self._take_one, eye), self._slot.fail)
            for eye, camera in enumerate(cameras)
        ]

    @property
    def n_unpaired(self) -> int:
        """Pictures that were dropped for want of a partner."""
        return self._matcher.n_unpaired

    @property
    def n_stale(self) -> int:
        """Pictures and pairs that were dropped because they were too old or damaged."""
        return self._n_aged + sum(camera.n_stale for camera in self.cameras)

    def take(self, timeout_s: float) -> TimedPair:
        """The newest pair.

        Raises:
            DeviceTimeout: none came in time.
            DeviceLost: a camera is gone, or silent for too long.
        """
        deadline_s = time.monotonic() + timeout_s
        while True:
            pair = self._slot.take(max(0.0, deadline_s - time.monotonic()))
            now_ns = self._clock.now_ns()
            if pair is None:
                raise self._silence(now_ns, timeout_s)
            if now_ns - pair.captured_ns <= self._max_age_ns:
                return pair
            self._n_aged += 1

    def set(self, control_name: str, value: float) -> float:
        """Set a control of each camera and return what they say they have.

        Raises:
            UnsupportedControl: refused, or the cameras took different values.
            DeviceTimeout, DeviceLost: no answer.
        """
        try:
            has = [
                reader.ask(lambda camera: camera.set(control_name, value), _ANSWER_S)
                for reader in self._readers
            ]
        except TimeoutError as error:
            raise DeviceTimeout(f"a camera did not take {control_name} in time") from error
        if len(set(has)) > 1:
            raise UnsupportedControl(
                f"the cameras took different values for {control_name}: "
                + " and ".join(f"{value:g}" for value in has),
                subject=control_name,
                remedy="ask for a value that both can take",
            )
        return has[0]

    def close(self) -> None:
        """Stop; whoever waits for a pair gets a `DeviceLost`.

        A grab that hangs is left behind: its thread gives the camera back when it returns.
        """
        self._slot.fail(DeviceLost("the cameras were closed", remedy="open them again"))
        for reader in self._readers:
            reader.stop()
        deadline_s = time.monotonic() + _JOIN_S
        for reader in self._readers:
            reader.join(max(0.0, deadline_s - time.monotonic()))

    def _take_one(self, eye: int, picture: TimedPicture) -> None:
        """A picture came from a reader thread."""
        self._heard_ns[eye] = self._clock.now_ns()
        pair = self._split(picture) if len(self.cameras) == 1 else self._matcher.add(eye, picture)
        if pair is None:
            return
        left, right = pair
        skew_ns = right.captured_ns - left.captured_ns
        received_ns = self._clock.now_ns()
        self._slot.put(
            TimedPair(left.picture, right.picture, left.captured_ns, received_ns, skew_ns)
        )

    @staticmethod
    def _split(both: TimedPicture) -> tuple[TimedPicture, TimedPicture]:
        left, right = np.split(both.picture, 2, axis=1)
        captured_ns = both.captured_ns
        return (
            TimedPicture(np.ascontiguousarray(left), captured_ns),
            TimedPicture(np.ascontiguousarray(right), captured_ns),
        )

    def _silence(self, now_ns: int, timeout_s: float) -> DeviceTimeout | DeviceLost:
        """Why no pair came: a camera is silent, or the two never expose together."""
        heard_ns = min(self._heard_ns)
        name = self.cameras[self._heard_ns.index(heard_ns)].identity.serial
        if now_ns - heard_ns > _LOST_AFTER_NS:
            return DeviceLost(
                f"camera {name} has given no new picture for {(now_ns - heard_ns) * 1e-9:.0f} s",
                subject=name,
                remedy="plug it in again; it is opened by itself",
            )
        miss_ns = self._matcher.last_miss_ns
        reason = "" if miss_ns is None else f"; the last two were {miss_ns * 1e-6:.1f} ms apart"
        return DeviceTimeout(
            f"no pair of pictures came within {timeout_s:g} s{reason}",
            subject=name,
            remedy="" if miss_ns is None else "synchronise the cameras, or raise max_skew_ms",
        )

"""Checks of a measurement that need no fitted pose: they run on the helper, beside the fit."""

import threading
from functools import partial
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import Job, begin_on_helper
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration.verdict import Agreement
from navapp.stereo import (
    CLIPPED_REACH_PX,
    CoarseMap,
    NearerSearch,
    StereoHealth,
    fill_surroundings,
    find_near_clipped,
    match_nearer,
    measure_health,
)
from navapp.tracking.agreement import compare
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import FrameTimings, Stopwatch, Surroundings


class PairCheck(NamedTuple):
    """What is known of one measurement."""

    health: StereoHealth  # of its pair of pictures
    agreement: Agreement | None  # of the model where it was matched; None of a free measurement
    # (h, w) coarse disparity of whatever lies in its box; None out of view or depth.
    coarse_px: NDArray[np.float32] | None
    is_near_clipped: NDArray[np.bool_]  # (h, w) as of `find_near_clipped`, in its box


class PairChecks:
    """Checks what is measured in one pair, one measurement at a time, on the helper.

    As a context manager it leaves nothing running. `coarse` is the map of what lies around the
    bone, being made; where it does not reach, or without one, a check matches anew. With `nearer`
    its gaps are filled as well.
    """

    def __init__(
        self,
        meter: SurfaceMeter,
        pair: RectifiedPair,
        coarse: Job[CoarseMap | None] | None = None,
        nearer: NearerSearch | None = None,
    ) -> None:
        self._meter, self._pair, self._coarse = meter, pair, coarse
        self._nearer = nearer
        self._filling: Job[tuple[Surroundings | None, FrameTimings]] | None = None
        self._begun: tuple[Measurement, Job[PairCheck]] | None = None

    def check(self, measured: Measurement, pose: RigidTransform) -> Job[PairCheck]:
        """The check of a measurement at a pose; a check of another measurement is dropped."""
        if self._begun is None or self._begun[0] is not measured:
            self._drop()
            run = partial(_run_check, self._meter, self._pair, self._coarse, measured, pose)
            self._begun = measured, begin_on_helper(run)
            # After the check, beside the fit: before it, the measurement needs the helper.
            self._begin_filling()
        return self._begun[1]

    def surroundings(self, watch: Stopwatch) -> Surroundings | None:
        """The coarse map with its gaps filled; None if that was not asked for, or out of view.

        The watch is told what the helper took.
        """
        self._begin_filling()
        if self._filling is None:
            return None
        is_new = not self._filling.is_fetched
        surroundings, timings = self._filling.result()
        if is_new:
            watch.add_beside(timings)
        return surroundings

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        self._drop()
        for job in (self._filling, self._coarse):
            if job is not None and not job.is_fetched:
                job.drop()

    def _begin_filling(self) -> None:
        if self._filling is None and self._nearer is not None and self._coarse is not None:
            fill = partial(_fill_timed, self._coarse, self._nearer, threading.get_ident())
            self._filling = begin_on_helper(fill)

    def _drop(self) -> None:
        if self._begun is not None and not self._begun[1].is_fetched:
            self._begun[1].drop()


def _fill_timed(
    coarse_job: Job[CoarseMap | None], nearer: NearerSearch, asking: int
) -> tuple[Surroundings | None, FrameTimings]:
    """The filled map, and what it took where this is not the asking thread."""
    coarse, watch = coarse_job.result(), Stopwatch()
    if coarse is None:
        return None, watch.timings
    coarse = match_nearer(coarse, nearer)
    watch.lap("nearer_beside")
    filled = fill_surroundings(coarse)
    watch.lap("fill_beside")
    return filled, FrameTimings() if threading.get_ident() == asking else watch.timings


# Not a method: a job that knew its checks would keep them, and a frame's pictures, alive.
def _run_check(
    meter: SurfaceMeter,
    pair: RectifiedPair,
    coarse_job: Job[CoarseMap | None] | None,
    measured: Measurement,
    pose: RigidTransform,
) -> PairCheck:
    found, view = measured.disparity, measured.rendered
    depth_mm = float(pose.apply(meter.model.centre_mm)[2])
    health = measure_health(pair, found, meter.geometry.disparity_px(depth_mm))
    coarse = None if coarse_job is None else coarse_job.result()
    coarse_px = None if coarse is None else coarse.over(found.box)
    if coarse_px is None:
        coarse = meter.measure_coarsely(pair, pose, found.box)
        coarse_px = None if coarse is None else coarse.disparity_px
    is_near_clipped = find_near_clipped(pair.left[found.box.slices], CLIPPED_REACH_PX)
    agreement = None
    if view is not None:
        agreement = compare(view, meter.model, found, meter.geometry, coarse_px, is_near_clipped)
    return PairCheck(health, agreement, coarse_px, is_near_clipped)

"""What a measurement on the model says beside the fit: of its pictures, and of the model.

Neither asks for the pose that the fit finds: both are worked out while it is looked for.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import Job, beside
from navapp.geometry.transform import RigidTransform
from navapp.stereo import StereoHealth
from navapp.tracking.agreement import Agreement
from navapp.tracking.surface_meter import Measurement


class CrossCheck(NamedTuple):
    """Of one measurement.

    Attributes:
        health: of its pair of pictures.
        agreement: of the model where it was matched; None of a free measurement.
        coarse_px: (h, w) coarse disparity of whatever lies in its box; None out of view or depth.
    """

    health: StereoHealth
    agreement: Agreement | None
    coarse_px: NDArray[np.float32] | None


class CrossChecks:
    """Of what is measured in one pair of pictures; a context that leaves none running."""

    def __init__(self, check: Callable[[Measurement, RigidTransform], CrossCheck]) -> None:
        """Of one pair of pictures.

        Args:
            check: of a measurement around a pose in the rectified camera.
        """
        self._check = check
        self._begun: tuple[Measurement, Job[CrossCheck]] | None = None

    def begin(self, measured: Measurement, pose: RigidTransform) -> None:
        """Begin the check of a measurement on the helper."""
        self._drop()
        self._begun = measured, beside(partial(self._check, measured, pose))

    def of(self, measured: Measurement, pose: RigidTransform) -> CrossCheck:
        """The check of a measurement: the one that was begun, or a new one."""
        if self._begun is not None and self._begun[0] is measured:
            return self._begun[1].result()
        return self._check(measured, pose)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._drop()

    def _drop(self) -> None:
        if self._begun is not None:
            self._begun[1].drop()

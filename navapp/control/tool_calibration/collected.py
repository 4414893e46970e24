"""Poses of a plate that a calibration has collected, and what they say of the tool."""

from datetime import date

import numpy as np

from calibration.pivot import Pivot, solve_pivot
from calibration.tool_axis import ToolAxis, solve_axis
from navapp.geometry.transform import FloatArray
from navapp.tools.paper import Paper, as_designed
from navapp.tools.paper_fit import correct_pose, fit_paper
from navapp.tools.plate import Plate
from navapp.tools.plate_fit import PlateFit
from navapp.tools.tool import Tool

# What all poses have in common, as the shine of the paper, no residual shows.
_LEAST_SIGMA_MM = 0.02


class CollectedPoses:
    """Fits of one plate: while its tip stood still, and while it was turned about itself.

    Args:
        plate: of the tool.
    """

    def __init__(self, plate: Plate) -> None:
        self._plate = plate
        self.pivoting: list[PlateFit] = []
        self.turns: list[list[PlateFit]] = []

    def solve_tip(self) -> tuple[Paper, Pivot]:
        """Paper and tip.

        Raises:
            ResultError: too few poses, or the tool was hardly leaned.
        """
        fits = [*self.pivoting, *(fit for turn in self.turns for fit in turn)]
        paper = fit_paper(fits, as_designed(self._plate))
        return paper, solve_pivot(self._matrices(self.pivoting, paper))

    def solve_axis(self, paper: Paper, tip_mm: FloatArray) -> ToolAxis:
        """The axis, towards the tip.

        Raises:
            ResultError: a turn has too few poses, or hardly turned the tool.
        """
        return solve_axis([self._matrices(turn, paper) for turn in self.turns], tip_mm)

    def check(self) -> None:
        """Whether tip and axis can be solved for.

        Raises:
            ResultError: as of `solve_tip` and `solve_axis`.
        """
        paper, pivot = self.solve_tip()
        if self.turns:
            self.solve_axis(paper, pivot.robust.tip_mm)

    def solve(self, made_on: date, rig_id: str) -> tuple[Tool, Pivot, ToolAxis | None]:
        """The tool, with how its tip and its axis were found.

        Raises:
            ResultError: as of `solve_tip` and `solve_axis`.
        """
        paper, pivot = self.solve_tip()
        tip_mm = pivot.robust.tip_mm
        axis = self.solve_axis(paper, tip_mm) if self.turns else None
        tool = Tool(
            self._plate,
            paper,
            tip_mm,
            pivot.covariance_mm2 + _LEAST_SIGMA_MM**2 * np.eye(3),
            None if axis is None else axis.axis,
            0.0 if axis is None else axis.sigma_rad,
            made_on,
            rig_id,
        )
        return tool, pivot, axis

    @staticmethod
    def _matrices(fits: list[PlateFit], paper: Paper) -> FloatArray:
        return np.array([correct_pose(fit, paper).matrix for fit in fits])

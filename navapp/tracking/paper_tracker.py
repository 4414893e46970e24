"""The paper's proposal as a tracker: filled occlusions, and BiMCC-ICP as it is printed.

Source: the paper, section 3.2, figure 2, algorithm 2 on top of algorithm 1. The slips of its print
that are mended here are listed in docs/how/registration.md. What differs from section 3.1 is all
that stands here; the refinement on the contour, equation (4) there, is no step of section 3.2.
"""

from navapp.geometry.transform import RigidTransform
from navapp.registration import solve_bimcc_literal
from navapp.tracking.frame import Frame
from navapp.tracking.icp_tracker import IcpTracker
from navapp.tracking.surface_meter import Measurement
from navapp.values import PoseEstimate


class PaperTracker(IcpTracker):
    """Finds one bone from a pose, and follows it by its box: one fit in every frame.

    Occlusions are filled by weighted least squares: border ones from right to left, the others from
    left to right, mismatches from both. Filled points are registered like matched ones, as the
    paper has it.
    """

    fills_occlusions = True
    n_among = 20_000  # chosen

    def estimate(self, frame: Frame, measured: Measurement, start: RigidTransform) -> PoseEstimate:
        """The pose by BiMCC-ICP: equations (4) to (9) of section 3.2, algorithm 2."""
        return solve_bimcc_literal(measured.scene, self.model, start, self.n_points).estimate

"""The paper's contour refinement."""

import numpy as np

from navapp.tracking.contour import ContourRefiner
from navapp.tracking.outline import OutlineMeter
from navapp.tracking.surface_meter import NEAR_BOX, WIDE_VIEW
from tests.registration.shapes import GEOMETRY, TRUE
from tests.tracking.rooms import blank_pair, measured_map, room


def test_the_outline_moves_onto_the_edges_of_both_pictures() -> None:
    """Equation (4): the mean of the squared distances, in px, becomes smaller."""
    a = room()
    frame, model, meter = a.frames[0], a.tracker.model, a.tracker.meter
    begun = a.tracker.begin(frame, a.truth(frame), WIDE_VIEW)
    measured = meter.measure_freely(begun.pair, begun.start, NEAR_BOX).disparity
    outline = OutlineMeter(model, meter.geometry)
    refiner = ContourRefiner(model, outline)

    def mean_square_px2(pose) -> float:
        view = model.render(pose, meter.geometry, measured.box)
        return float(np.mean(outline.block(begun.pair, pose, view, measured).residual ** 2))

    for shift_mm in ((0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.3, 0.3, 0.0)):
        start = begun.start.move((*shift_mm, 0.0, 0.0, 0.0), np.zeros(3))
        found = refiner.refine(begun.pair, start, measured)
        assert mean_square_px2(found) < 0.5 * mean_square_px2(start)


def test_without_edges_a_pose_stays() -> None:
    model = room().tracker.model
    refiner = ContourRefiner(model, OutlineMeter(model, GEOMETRY))
    assert refiner.refine(blank_pair(), TRUE, measured_map(model.bone)) is TRUE

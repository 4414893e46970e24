"""The view of a bone that fits two pictures best, among those near an expected pose.

Source: the paper, section 3.1, equations (2) and (3) ("the aspect with the highest similarity"),
with the gate of `edge_tables`.
"""

from dataclasses import replace

import numpy as np

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration.edge_tables import make_edge_tables
from navapp.registration.hypotheses import compute_poses, place_hypothesis, vary_hypotheses
from navapp.registration.model import RegistrationModel
from navapp.registration.score_kernels import score_edges
from navapp.values import AspectGraph

# All chosen, on a simulated knee: pictures are made so many times smaller; a gradient is felt so
# far there; edge points of a view.
_SCALE, _REACH_PX, _N_POINTS = 2, 0, 120
# Views within this angle compete, turned about the line of sight and moved by so much.
_STEP_DEG, _ROLL_DEG, _SHIFT_MM = 8.0, 4.0, 2.0
_SPARE_PX = 32
# The bone may be so much nearer than its middle.
_IN_FRONT_MM = 60.0


def find_best_view(
    pair: RectifiedPair, model: RegistrationModel, aspects: AspectGraph, expected: RigidTransform
) -> RigidTransform:
    """The pose of the best view near an expected pose, which competes too.

    Args:
        pair: grey pictures; the bone lies in its box.
        model: of the bone.
        aspects: its edges as seen from all sides from which it may be seen.
        expected: rectified left camera from bone.
    """
    pair = _crop_rows(pair)
    centre_mm = expected.apply(model.centre_mm)
    here = place_hypothesis(aspects.directions, expected, model.centre_mm)
    some = vary_hypotheses(here, aspects.directions, _STEP_DEG, _ROLL_DEG, _SHIFT_MM)
    nearest_mm = max(float(centre_mm[2]) - _IN_FRONT_MM, 1.0)
    tables = make_edge_tables(pair, _SCALE, _REACH_PX, pair.geometry.disparity_px(nearest_mm))
    score = np.zeros(len(some.place), dtype=np.float32)
    edges = aspects.starts, aspects.points_mm, aspects.tangents
    score_edges(some, *edges, _N_POINTS, tables, score, (0, len(score)))
    rotations, shifts_mm = compute_poses(some)
    best = int(np.argmax(score))
    return RigidTransform.from_parts(
        expected.target, expected.source, rotations[best], shifts_mm[best]
    )


def _crop_rows(pair: RectifiedPair) -> RectifiedPair:
    """The pair with no more rows than its box has, and some to spare."""
    first = max(pair.box.y - _SPARE_PX, 0) // _SCALE * _SCALE
    rows = np.s_[first : pair.box.y + pair.box.height + _SPARE_PX]
    left, right = pair.left[rows], pair.right[rows]
    geometry = replace(
        pair.geometry, centre_y_px=pair.geometry.centre_y_px - first, height=len(left)
    )
    return RectifiedPair(left, right, geometry, replace(pair.box, y=pair.box.y - first))

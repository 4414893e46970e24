from types import SimpleNamespace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from navapp.tracking.frame import Frame
from navapp.tracking.search.after_loss import SearchAfterLoss, make_starts_after_loss
from navapp.tracking.surface_meter import WIDE_BOX
from navapp.values import Stopwatch

CENTRE = np.array([3.0, -20.0, 15.0])
LAST = RigidTransform.from_parts(
    "left_rect", "femur", rotation_from_vector((0.4, -0.2, 0.1)), (10.0, 5.0, 450.0)
)


def far_mm(start: RigidTransform) -> float:
    return float(np.linalg.norm(start.apply(CENTRE) - LAST.apply(CENTRE)))


def cycle() -> list[list[RigidTransform]]:
    return [make_starts_after_loss(LAST, CENTRE, n_searches) for n_searches in range(1, 21, 2)]


def test_the_first_and_every_other_search_looks_where_it_was() -> None:
    assert all(
        make_starts_after_loss(LAST, CENTRE, n_searches) == [] for n_searches in range(0, 40, 2)
    )
    assert all(make_starts_after_loss(LAST, CENTRE, n_searches) for n_searches in range(1, 40, 2))


def test_every_start_has_its_turn_and_then_again() -> None:
    seen = {start.matrix.round(9).tobytes() for part in cycle() for start in part}
    assert len(seen) == sum(len(part) for part in cycle())
    again = make_starts_after_loss(LAST, CENTRE, 21)
    for one, other in zip(cycle()[0], again, strict=True):
        np.testing.assert_array_equal(one.matrix, other.matrix)


def test_no_search_has_much_more_work_than_another() -> None:
    sizes = [len(part) for part in cycle()]
    assert max(sizes) - min(sizes) <= 1
    assert max(sizes) <= 25


def test_every_part_reaches_far_and_tilts_far() -> None:
    for part in cycle():
        assert max(far_mm(start) for start in part) == pytest.approx(40.0)
        assert min(far_mm(start) for start in part) <= 20.0 + 1e-9
        assert max(rotation_angle_deg(start, LAST) for start in part) > 25.0


def test_all_directions_are_looked_in() -> None:
    shifts = [start.apply(CENTRE) - LAST.apply(CENTRE) for part in cycle() for start in part]
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        assert max(shift @ axis for shift in shifts) == pytest.approx(40.0)


def test_what_does_not_look_further_off_searches_where_it_was() -> None:
    """And measures nothing beside: a meter would be asked in vain."""
    near = SimpleNamespace(find_freely=lambda *given: given)
    meter = SimpleNamespace(model=SimpleNamespace(centre_mm=CENTRE))
    search = SearchAfterLoss(meter, near, scorer=None)
    frame = Frame(None, None, LAST, Stopwatch())
    assert list(search.find(frame, 2)) == [(frame, WIDE_BOX)]

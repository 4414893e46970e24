import pytest

from drivers.fixed_mirror import FixedMirror
from navapp.errors import UnsupportedControl


def test_it_tells_its_angle_and_refuses_to_move():
    mirror = FixedMirror(43.5)
    mirror.home(1.0)
    assert mirror.position_deg() == 43.5
    assert not mirror.info.is_movable
    with pytest.raises(UnsupportedControl, match=r"fixed at 43\.5 deg"):
        mirror.move_to(43.5, 1.0)


def test_angle_must_be_a_number():
    with pytest.raises(ValueError, match="finite"):
        FixedMirror(float("nan"))

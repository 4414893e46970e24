import numpy as np
import pytest

from drivers.frames import FrameMeter, StereoFrame


def make(left_shape, right_shape, dtype=np.uint8):
    left, right = np.zeros(left_shape, dtype), np.zeros(right_shape, dtype)
    return StereoFrame(left, right, 0, 0, 0, 7, "rig")


@pytest.mark.parametrize("shape", [(4, 6), (4, 6, 3)])
def test_grey_and_bgr_pairs_are_frames(shape):
    assert make(shape, shape).index == 7


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ((4, 6), (4, 5)),
        ((4, 6), (4, 6, 3)),
        ((4, 6, 4), (4, 6, 4)),
        ((4, 6, 1), (4, 6, 1)),
        ((4,), (4,)),
    ],
)
def test_other_shapes_are_refused(left, right):
    with pytest.raises(ValueError, match="same shape"):
        make(left, right)


def test_other_types_are_refused():
    with pytest.raises(ValueError, match="uint8"):
        make((4, 6), (4, 6), np.uint16)


def test_meter_tells_rate_and_skew_of_the_last_frames():
    meter = FrameMeter(window=3)
    assert (meter.rate_hz, meter.skew_ms) == (None, None)
    picture = np.zeros((2, 2), np.uint8)
    for captured_ns, skew_ns in ((0, 9_000_000), (10**9, 1_000_000), (11 * 10**8, 2_000_000)):
        meter.add(StereoFrame(picture, picture, captured_ns, captured_ns, skew_ns, 0, ""))
    meter.add(StereoFrame(picture, picture, 12 * 10**8, 12 * 10**8, 3_000_000, 0, ""))
    assert meter.rate_hz == pytest.approx(10.0)
    assert meter.skew_ms == pytest.approx(2.0)

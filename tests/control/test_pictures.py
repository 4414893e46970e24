import numpy as np
import pytest

from navapp.control.commands import Register
from navapp.control.pictures import Composer, banner, fit_to_display
from navapp.overlay import compose_video
from navapp.values import Reason, Status
from tests.control.fakes import Bench, a_plan, a_pose, a_rig, answer


def picture(height: int, width: int) -> np.ndarray:
    return np.full((height, width, 3), 200, dtype=np.uint8)


def test_a_picture_of_the_displays_size_is_passed_on() -> None:
    image = picture(48, 64)
    assert fit_to_display(image, 64, 48) is image


@pytest.mark.parametrize(
    ("size", "display", "columns", "rows"),
    [
        ((100, 200), (400, 400), (0, 400), (100, 300)),
        ((200, 100), (400, 400), (100, 300), (0, 400)),
        ((100, 200), (100, 50), (0, 100), (0, 50)),
        ((720, 1280), (1024, 768), (0, 1024), (96, 672)),
    ],
)
def test_a_picture_is_scaled_as_a_whole_with_black_beside_it(size, display, columns, rows) -> None:
    out = fit_to_display(picture(*size), *display)
    assert out.shape == (display[1], display[0], 3)
    lit = np.argwhere(out[:, :, 0] > 0)
    assert lit.min(axis=0).tolist() == [rows[0], columns[0]]
    assert (lit.max(axis=0) + 1).tolist() == [rows[1], columns[1]]
    assert (out[rows[0] : rows[1], columns[0] : columns[1]] == 200).all()


def test_the_banner_says_what_the_picture_is() -> None:
    bench = Bench()
    bench.frames(1)
    assert banner(bench.snapshot) == "1 opening - NO GUIDES: no registration has been accepted"
    bench.do(Register())
    bench.frames(1)
    assert banner(bench.snapshot) == "1 opening - CANDIDATE, not accepted"
    bench.accept()
    bench.frames(1)
    assert banner(bench.snapshot) == (
        "1 opening - NAVIGATING - error <= 0.80 mm - not verified on the patient"
    )


def test_of_a_refused_candidate_nothing_is_drawn() -> None:
    bench = Bench()
    bench.frames(1)
    bench.do(Register())
    camera = a_rig().left
    left = np.full((camera.height, camera.width, 3), 60, np.uint8)
    drawn = []
    for status in (Status.DEGRADED, Status.LOST):
        bench.script.tracked = answer(status, Reason.OUTLIERS, pose=a_pose())
        bench.frames(2)
        snapshot = bench.snapshot
        picture = Composer(a_rig(), a_plan()).compose_video(left, snapshot, "")
        plain = compose_video(left, None, banner(snapshot))
        drawn.append(bool((picture != plain).any()))
        assert snapshot.left_from_bone is not None
    assert drawn == [True, False]
    assert banner(snapshot) == "1 opening - CANDIDATE refused by the judge"

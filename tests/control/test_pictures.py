import numpy as np

from navapp.control.commands import Register
from navapp.control.pictures import Composer, banner
from navapp.overlay import compose_video
from navapp.values import Reason, Status
from tests.control.fakes import Bench, a_plan, a_pose, a_rig, answer


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

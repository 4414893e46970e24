"""What a frame and a session look like in JSON and in words."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.cli.results import (
    frame_text,
    frame_to_json,
    limb_to_json,
    reasons_text,
    rig_alarm_to_json,
    summarise,
    summarise_gaps,
    summarise_measured,
    summary_text,
)
from navapp.control.commands import DistrustRig
from navapp.control.frame_result import FrameResult
from navapp.limb import Gap, LimbAngles, LimbMeasurement
from navapp.values import MeasuredFace, Reason, ResectionPlane, Status
from tests.control.fakes import Bench, a_pose, answer, navigating

# What is said of the frame and not of a bone.
OF_THE_FRAME = {"index", "state", "stage", "bone", "bodies", "bone_version", "measured", "tools"}
TIBIA = answer(Status.DEGRADED, Reason.COVERAGE_LOW, pose=a_pose("tibia", x_mm=4.0))


def a_result(**others) -> FrameResult:
    return replace(navigating(Bench()).results[-1], others=others)


def test_another_bone_has_the_keys_of_the_frames_own_pose() -> None:
    frame = frame_to_json(a_result(tibia=TIBIA), {"femur": 0.1, "tibia": 0.7})
    tibia = frame["bodies"]["tibia"]
    assert set(tibia) == set(frame) - OF_THE_FRAME
    assert (frame["status"], tibia["status"]) == ("OK", "DEGRADED")
    assert (frame["tre_mm"], tibia["tre_mm"]) == (0.1, 0.7)
    assert tibia["reasons"] == [Reason.COVERAGE_LOW.value]
    assert tibia["camera_from_model"] == a_pose("tibia", x_mm=4.0).to_list()
    assert tibia["covariance"] == TIBIA.estimate.covariance.tolist()
    assert tibia["predicted_tre_mm"] == TIBIA.verdict.predicted_tre_mm


def test_a_frame_in_which_no_other_bone_had_its_turn_says_nothing_of_one() -> None:
    frame = frame_to_json(a_result(), {})
    assert frame["bodies"] == {}
    assert frame["tre_mm"] is None


def test_the_summary_counts_each_bone_for_itself() -> None:
    lost = answer(Status.LOST, Reason.OUT_OF_VIEW, has_pose=False)
    results = [
        a_result(tibia=TIBIA),
        a_result(),
        a_result(tibia=lost),
        a_result(patella=answer(pose=a_pose("patella"))),
    ]
    summary = summarise([frame_to_json(result, {}) for result in results], 1.0)
    counted = {key: summary[key] for key in ("frames", "ok", "degraded", "lost")}
    assert counted == {"frames": 4, "ok": 4, "degraded": 0, "lost": 0}
    assert summary["bodies"] == {
        "tibia": {"frames": 2, "ok": 0, "degraded": 1, "lost": 1},
        "patella": {"frames": 1, "ok": 1, "degraded": 0, "lost": 0},
    }
    lines = summary_text(summary).splitlines()
    assert lines[0] == "4 frames: 4 OK, 0 degraded, 0 lost"
    assert "other bone, tibia: 2 frames: 0 OK, 1 degraded, 1 lost" in lines


def test_a_line_a_frame_names_the_other_bones() -> None:
    assert frame_text(a_result(tibia=TIBIA)).endswith(" | tibia DEGRADED 0 ms")
    assert "tibia" not in frame_text(a_result())


def test_a_frame_of_a_moved_rig_says_so() -> None:
    bench = navigating(Bench())
    bench.do(DistrustRig("bumped"))
    bench.frames(2)
    frame = frame_to_json(bench.results[-1], {})
    assert frame["state"] == "fault"
    assert frame["reasons"] == [Reason.RIG_MOVED.value]
    assert frame_to_json(bench.results[0], {})["reasons"] == [Reason.NOT_NAVIGATING.value]


def test_a_replay_says_where_its_session_found_the_rig_moved() -> None:
    assert rig_alarm_to_json("sim", 5, DistrustRig("bumped")) == {
        "name": "sim",
        "alarm": "rig moved, recalibrate (bumped)",
        "moved_after_frame": 5,
    }


def test_faces_are_told_against_their_plan_and_joined_over_frames() -> None:
    plane = ResectionPlane("femur", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    little = np.diag([2e-6, 2e-6, 2e-4])
    faces = [
        MeasuredFace(plane, np.array([0.0, np.tan(np.radians(1.0)), off]), little, share)
        for off, share in ((-0.5, 0.6), (-0.3, 0.8))
    ]
    told = [{"top": face} for face in faces]
    frame = frame_to_json(replace(a_result(), measured=told[0]), {})
    assert frame["measured"]["top"]["offset_mm"] == -0.5
    assert frame["measured"]["top"]["angle_deg"] == pytest.approx(1.0)
    assert frame["measured"]["top"]["point_mm"][2] == pytest.approx(-0.5, abs=1e-3)
    measured = summarise_measured([*told, {}])
    assert measured["top"]["offset_mm"] == pytest.approx(-0.4)
    assert measured["top"]["seen_share"] == 0.8
    lines = summary_text({**summarise([frame], 1.0), "measured": measured}).splitlines()
    assert (
        "cut top: 1.00 deg (+- 0.20) and -0.40 mm (+- 0.03) from its plan, 80 % of it seen" in lines
    )


def a_limb(flexion_deg: float, gap_mm: float = 2.0) -> LimbMeasurement:
    angles = LimbAngles(flexion_deg, -1.5, 4.0, 0.3, 0.2, 0.4)
    return LimbMeasurement(angles, {"medial": Gap(gap_mm, 0.1), "lateral": Gap(3.0, 0.2)})


def test_a_limb_has_angles_gaps_and_the_bounds_of_both() -> None:
    frame = frame_to_json(replace(a_result(), limb=a_limb(84.0)), {})
    assert frame["limb"] == {
        "flexion_deg": 84.0, "varus_deg": -1.5, "internal_rotation_deg": 4.0,
        "bound_deg": {"flexion": 0.3, "varus": 0.2, "internal_rotation": 0.4},
        "gap_medial_mm": 2.0, "gap_lateral_mm": 3.0,
        "bound_mm": {"medial": 0.1, "lateral": 0.2},
        "not_known": None,
    }  # fmt: skip
    assert "limb" not in frame_to_json(a_result(), {})


def test_of_a_limb_without_axes_only_the_gaps_are_known() -> None:
    known = limb_to_json(LimbMeasurement(None, {"medial": Gap(2.0, 0.1)}, "no hip centre"))
    assert (known["flexion_deg"], known["bound_deg"]["varus"]) == (None, None)
    assert (known["gap_medial_mm"], known["gap_lateral_mm"]) == (2.0, None)
    assert known["not_known"] == "no hip centre"


def test_gaps_in_extension_and_flexion_are_those_of_the_nearest_frames() -> None:
    limbs = [None, a_limb(84.0, 1.0), a_limb(88.0, 2.0), a_limb(40.0, 3.0)]
    summary = summarise_gaps(limbs)
    assert summary["at_90_deg"]["gap_medial_mm"] == 2.0
    assert summary["at_0_deg"] is None


def test_why_frames_were_not_ok_is_told_most_frequent_first() -> None:
    frames = [
        {"status": "OK", "reasons": []},
        {"status": "LOST", "reasons": ["a"]},
        *({"status": "DEGRADED", "reasons": ["b", "c"]} for _ in range(2)),
    ]
    assert reasons_text(frames) == "not OK, and in how many frames: b (2); c (2); a (1)"
    assert reasons_text(frames[:1]) == ""
    many = [{"status": "LOST", "reasons": list("abcdef")}]
    assert reasons_text(many).endswith("d (1); 2 more in --json")

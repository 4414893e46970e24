"""Recordings scored by each kind of truth; what the methods answer is given by hand."""

import csv
import json
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest

from drivers.recorded_sources import RecordedTimes
from navapp.config import Configuration
from navapp.control.stages import STAGES
from navapp.errors import InputError, ResultError, RigError, UsageError
from navapp.evaluation.following import Answers, FrameAnswer
from navapp.evaluation.recording import study as recording
from navapp.evaluation.recording.report import FILES, check_folder, write_report
from navapp.evaluation.recording.rows import RecordingRow, make_rows
from navapp.evaluation.recording.study import RecordedFrames, Studied, Study, open_frames, study
from navapp.evaluation.recording.tracker_motion import split_halves, to_seconds
from navapp.evaluation.recording.truth_files import DivotTruth, OwnError, PoseTruth, Touch, Truth
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.values import BoneModel, Plan, Prior, Status, Verdict
from tests.control.fakes import a_plan, a_pose, a_rig, answer
from tests.evaluation.tracked_twice import CENTRE_MM, track_twice
from tests.geometry.shapes import sphere

pytestmark = pytest.mark.usefixtures("empty_plots")

RIG, PLAN = a_rig(), a_plan()
NOT_STATED = OwnError()


class GreySource:
    """Grey pairs of the rig's size, numbered from 100 on."""

    name = "grey"
    rate_hz = None

    def __init__(self, n_pairs: int, times_ns: Sequence[int] | None = None) -> None:
        self.numbers = tuple(range(100, 100 + n_pairs))
        self.times = times_ns and tuple(RecordedTimes(one, 2_000_000) for one in times_ns)
        self.loaded: list[int] = []

    def load(self, place: int):
        self.loaded.append(place)
        grey = np.full((RIG.height, RIG.width), 90, np.uint8)
        return grey, grey

    def close(self) -> None:
        pass


def a_study(truth: Truth, plan=PLAN) -> Study:
    prior = Prior({"femur": a_pose()})
    return Study("bench/1", truth, Configuration(), RIG, plan, prior, STAGES[0])


def say(word: str) -> Verdict:
    """With a bound of half a millimetre."""
    return replace(answer(Status(word)).verdict, predicted_tre_mm=0.5)


def studied(
    monkeypatch,
    given: Study,
    source: GreySource,
    **answers: Sequence[tuple[str, RigidTransform | None]],
) -> Studied:
    """Of methods that say these words and poses, a pair for each picture."""

    def follow(sequence, method):
        assert all(pose is None for pose in sequence.truth), "a method is given no truth"
        frames = [
            FrameAnswer(pose, None, say(word), 20.0 + n, is_search=n == 0)
            for n, (word, pose) in enumerate(answers[method])
        ]
        return Answers(tuple(frames), 1.5, 1, given.plan.bones["femur"].mesh)

    monkeypatch.setattr(recording, "follow", follow)
    return study(given, RecordedFrames(source, RIG, 15.0), list(answers))


def shifted(x_mm: float) -> RigidTransform:
    return a_pose(x_mm=x_mm)


SAID = [
    ("OK", shifted(0.0)), ("OK", shifted(0.25)), ("OK", shifted(3.0)), ("DEGRADED", shifted(2.0)),
    ("LOST", None), ("DEGRADED", shifted(0.5)), ("OK", shifted(0.75)),
]  # fmt: skip


def by_poses(monkeypatch, own: OwnError = NOT_STATED) -> Studied:
    # Of picture 106 nothing is known.
    poses = {"femur": {100 + n: shifted(0.0) for n in range(6)}}
    given = a_study(PoseTruth(poses, own))
    return studied(monkeypatch, given, GreySource(7), icp=SAID, bimcc=SAID)


def row_of(one: Studied, method: str) -> RecordingRow:
    (row,) = (row for row in make_rows(one) if row.method == method)
    return row


def test_errors_by_poses(monkeypatch) -> None:
    row = row_of(by_poses(monkeypatch), "bimcc")
    assert row.counted.errors_mm == pytest.approx([0.25, 3.0])
    assert (row.figures.n_frames, row.known.n_frames, row.figures.n_ok) == (6, 5, 3)
    assert row.n_wrong == 1, "3 mm off, with a bound of 0.5 mm, and OK"
    assert row.coverage == 0.5
    assert row.to_json()["tre_refused_mm"] == pytest.approx(1.25)
    assert row.counted.mean_displacement_mm == pytest.approx(1.6, rel=0.1)
    told = row.to_json()
    assert told["verdicts"] == {
        "OK": {"within_1_mm": 1, "beyond_1_mm": 1, "no_pose": 0},
        "DEGRADED": {"within_1_mm": 1, "beyond_1_mm": 1, "no_pose": 0},
        "LOST": {"within_1_mm": 0, "beyond_1_mm": 0, "no_pose": 1},
    }
    assert told["sample"] == "bench/1"
    assert told["situation"] == "recording"
    assert (told["ok_share"], told["refused"], told["frames_with_truth"]) == (0.5, 3, 5)
    assert told["fps"] == pytest.approx(1e3 / 23.5)


def test_of_the_papers_methods_every_pose_counts(monkeypatch) -> None:
    row = row_of(by_poses(monkeypatch), "icp")
    assert row.counted.errors_mm == pytest.approx([0.25, 3.0, 2.0, 0.5])


def test_the_worst_ok_frames_are_drawn(monkeypatch) -> None:
    one = by_poses(monkeypatch)
    assert one.leading == "bimcc"
    assert [frame.index for frame, _ in one.pictures] == [102, 101]
    picture = cv2.imdecode(np.frombuffer(one.pictures[0][1], np.uint8), cv2.IMREAD_COLOR)
    spread = picture.astype(int).max(axis=2) - picture.astype(int).min(axis=2)
    assert (picture.min(axis=2) > 180).any(), "the true outline is white"
    assert spread.max() > 60, "the drawn one is green"


def test_errors_by_touched_points(monkeypatch) -> None:
    divot = np.array([5.0, -3.0, 12.0])
    at = shifted(0.0).apply(divot)
    touched = tuple(Touch(number, "a", at) for number in (101, 102, 104))
    given = a_study(DivotTruth({"a": divot}, touched))
    row = row_of(studied(monkeypatch, given, GreySource(7), bimcc=SAID), "bimcc")
    assert row.counted.errors_mm == pytest.approx([0.25, 3.0])
    assert row.known.n_frames == 3
    assert row.verdicts["LOST"].n_without_pose == 1
    assert row.coverage is None
    assert row.n_wrong == 1, "OK and 3 mm off at the points: no bound speaks of these"
    assert row.counted.mean_displacement_mm is None


def test_touched_points_are_not_compared_with_the_bound(monkeypatch, tmp_path) -> None:
    touched = (Touch(101, "a", shifted(0.0).apply(np.zeros(3))),)
    given = a_study(DivotTruth({"a": np.zeros(3)}, touched))
    write_report(tmp_path, [studied(monkeypatch, given, GreySource(7), bimcc=SAID)])
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "error against bound" not in page
    assert page.count("<svg") == 1


def test_a_frame_in_which_no_bone_was_looked_for_has_no_time(monkeypatch) -> None:
    given = a_study(PoseTruth({"femur": {101: shifted(0.0)}}, NOT_STATED))
    frames = (
        FrameAnswer(shifted(0.0), None, say("OK"), 20.0, is_search=True),
        FrameAnswer(None, None, None, 1.0, is_search=False),
        FrameAnswer(shifted(0.0), None, say("OK"), 40.0, is_search=False),
    )
    mesh = PLAN.bones["femur"].mesh
    monkeypatch.setattr(recording, "follow", lambda *_: Answers(frames, 1.5, 1, mesh))
    recorded = RecordedFrames(GreySource(3), RIG, 15.0)
    assert row_of(study(given, recorded, ["bimcc"]), "bimcc").fps == pytest.approx(25.0)


def tracked_study() -> tuple[Study, GreySource, list]:
    """Of the two trackers' bone: study, pictures, and what the camera's tracker says."""
    data = track_twice(seconds=20.0)
    source = GreySource(len(data.times_ns), data.times_ns)
    ball = sphere(30.0, 24)
    mesh = TriangleMesh(ball.vertices_mm + CENTRE_MM, ball.faces)
    plan = Plan({"femur": BoneModel("femur", mesh, "right")})
    return a_study(data.truth, plan), source, [("OK", pose) for pose in data.poses]


def test_errors_by_another_tracker(monkeypatch) -> None:
    given, source, said = tracked_study()
    # What the judge refuses is not solved with, and is scored all the same.
    times_ns = RecordedFrames(source, RIG, 15.0).times_ns
    since_s = to_seconds(times_ns, times_ns[0])
    refused = int(np.flatnonzero(split_halves(since_s).is_to_score)[5])
    said[refused] = ("LOST", said[refused][1].move([9.0, 0, 0, 0, 0, 0], np.zeros(3)))
    one = studied(monkeypatch, given, source, bimcc=said)
    row = row_of(one, "bimcc")
    assert one.solved is not None
    assert refused + 100 in one.known
    assert one.known == {100 + n for n in one.solved.scored}
    assert len(row.counted.errors_mm) == row.known.n_frames - 1
    assert 0.02 < row.counted.mean_mm < 1.0
    assert row.to_json()["tre_refused_mm"] == pytest.approx(9.0, abs=0.5)


def test_poses_that_are_not_ok_are_not_solved_with(monkeypatch) -> None:
    given, source, said = tracked_study()
    with pytest.raises(ResultError, match="OK pose"):
        studied(monkeypatch, given, source, bimcc=[("DEGRADED", pose) for _, pose in said])


def test_what_is_written(monkeypatch, tmp_path) -> None:
    folder = check_folder(tmp_path / "out")
    one = by_poses(monkeypatch, own=OwnError(0.05, 0.02))
    content = write_report(folder, [one])
    json.dumps(content, allow_nan=False)
    assert {path.name for path in folder.iterdir()} == set(FILES) - {"evaluate.json"}
    page = (folder / "report.html").read_text("utf-8")
    assert page.count("<svg") == 2
    assert page.count("data:image/jpeg;base64,") == 2
    assert "0.05 mm and 0.02 degrees" in page
    tables = (folder / "tables.md").read_text("utf-8")
    assert "| bench/1 | `bimcc` | 6 | 5 | 3 | 1.625 | 1.625 |" in tables
    assert "| bench/1 | `bimcc` | DEGRADED | 1 | 1 | 0 |" in tables
    assert "evenly spaced" in tables
    rows = list(csv.DictReader((folder / "frames.csv").read_text("utf-8").splitlines()))
    assert len(rows) == 12
    assert [row["index"] for row in rows[:6]] == [str(n) for n in range(101, 107)]
    assert rows[5]["has_truth"] == "False"
    assert rows[5]["tre_mm"] == ""
    assert check_folder(folder) == folder, "written over by the next one"


def test_the_report_says_what_another_tracker_can_show(monkeypatch, tmp_path) -> None:
    given, source, said = tracked_study()
    content = write_report(tmp_path, [studied(monkeypatch, given, source, bimcc=said)])
    told = content["summary"]["recordings"]["bench/1"]["truth"]
    assert told["kind"] == "tracker"
    assert told["solved"]["by"] == "bimcc"
    tables = (tmp_path / "tables.md").read_text("utf-8")
    for words in ("upper bound", "the solve never saw", "taken up by the solved frames"):
        assert words in tables


def test_a_folder_that_cannot_be_made_is_refused_at_once(tmp_path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot be written"):
        check_folder(tmp_path / "file" / "out")


def test_another_folder_is_left_alone(tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("x")
    with pytest.raises(UsageError, match="something else"):
        check_folder(tmp_path)


def test_pairs_are_loaded_when_they_are_asked_for() -> None:
    source, told = GreySource(4, [10, 20, 35, 50]), []
    frames = RecordedFrames(source, RIG, 15.0, told.append)
    assert len(frames) == 4
    assert source.loaded == []
    frame = frames[2]
    assert (frame.captured_ns, frame.skew_ns, frame.index) == (35, 2_000_000, 102)
    assert source.loaded == [2]
    assert told == [4]
    assert RecordedFrames(GreySource(3), RIG, 10.0).times_ns == (0, 100_000_000, 200_000_000)


def test_pictures_of_another_rig_are_refused(tmp_path) -> None:
    for side in ("left", "right"):
        cv2.imwrite(str(tmp_path / f"{side}_0000.png"), np.zeros((40, 60), np.uint8))
    with (
        pytest.raises(RigError, match="60x40"),
        open_frames(str(tmp_path), RIG, 15.0, lambda _: None),
    ):
        pass

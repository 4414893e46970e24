"""The program that runs the peers, with made-up ones; and the peers themselves, where they are.

What needs the peers' environment is skipped, and counted, without it.
"""

import json
import os
from pathlib import Path

import pytest

from navapp.errors import UsageError
from navapp.evaluation.campaign import CampaignFolder
from navapp.evaluation.following import Answers, FrameAnswer
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.peers.program import check_peers, run_program
from navapp.evaluation.peers.scores import file_of, read_peers
from navapp.evaluation.sequence import KnownSequence
from navapp.values import Status, Verdict
from tests.bench import peer_frames
from tests.bench.peer_frames import Start, score

SETTINGS = TableSettings((Case("man", "opening", "patient"),), ("bimcc",), 1, 4, 1, is_quick=True)


@pytest.fixture(scope="module")
def sequence() -> KnownSequence:
    return SETTINGS.tests[0].render(5)


def start_at(sequence: KnownSequence, place: int) -> Start:
    surface = sequence.plan.bones[sequence.stage.bone].mesh
    return Start(place, sequence.truth[place], surface)


def resting(rig, surface, frame, pose):
    """A peer that takes the bone to lie still."""
    return lambda frame: pose


def lost(rig, surface, frame, pose):
    """A peer that never finds the bone again."""
    return lambda frame: None


@pytest.mark.release
def test_a_peer_is_scored_against_the_truth_in_all_frames_but_the_first(sequence) -> None:
    frames = score(sequence, start_at(sequence, 0), resting)
    assert [frame.index for frame in frames] == [1, 2, 3, 4]
    assert all(frame.ms >= 0.0 for frame in frames)
    # The patient moves.
    errors_mm = [frame.tre_mm for frame in frames]
    assert 0.0 < errors_mm[0] < errors_mm[-1]
    assert [frame.tre_mm for frame in score(sequence, start_at(sequence, 0), lost)] == [None] * 4


@pytest.mark.release
def test_frames_before_the_start_are_without_a_pose(sequence) -> None:
    before, at, *after = score(sequence, start_at(sequence, 2), resting)
    assert (before.index, before.tre_mm, before.ms) == (1, None, None)
    assert (at.index, at.tre_mm) == (2, pytest.approx(0.0, abs=1e-9))
    assert all(frame.tre_mm > 0.0 for frame in after)


@pytest.mark.release
def test_without_a_start_no_frame_has_a_pose(sequence) -> None:
    frames = score(sequence, None, resting)
    assert [(frame.index, frame.tre_mm, frame.ms) for frame in frames] == [
        (place, None, None) for place in (1, 2, 3, 4)
    ]


@pytest.mark.release
def test_a_test_is_followed_again_only_when_a_peer_is_missing_or_other_code(
    tmp_path, monkeypatch, capsys
) -> None:
    out = CampaignFolder(tmp_path / "out", SETTINGS).path
    path = file_of(out, SETTINGS.tests[0])
    peers = {"resting": resting}
    monkeypatch.setattr(peer_frames, "make_peers", lambda: peers)
    monkeypatch.setattr(peer_frames, "find_start", lambda sequence: start_at(sequence, 0))
    peer_frames.main(str(out))
    first = path.read_bytes()
    peer_frames.main(str(out))
    assert path.read_bytes() == first, "with its times"
    peers["lost"] = lost
    peer_frames.main(str(out))
    (done,) = read_peers(out, SETTINGS.tests)
    assert set(done.frames) == {"resting", "lost"}
    before = path.read_bytes()
    monkeypatch.setattr(peer_frames, "find_code", lambda: "other")
    peer_frames.main(str(out))
    assert path.read_bytes() != before
    assert capsys.readouterr().out.split() == [SETTINGS.tests[0].name] * 4


@pytest.mark.release
def test_peers_start_where_ours_is_ok(sequence, monkeypatch) -> None:
    said = iter([Status.DEGRADED, Status.LOST, Status.OK])
    surface = sequence.plan.bones[sequence.stage.bone].mesh

    def follow(here, _method) -> Answers:
        verdict = Verdict(next(said), 0.5, ())
        frame = FrameAnswer(here.truth[0], None, verdict, 20.0, is_search=True)
        return Answers((frame,), 1.0, 1, surface)

    monkeypatch.setattr(peer_frames, "follow", follow)
    assert peer_frames.find_start(sequence).place == 2
    said = iter([Status.DEGRADED] * 5)
    assert peer_frames.find_start(sequence).place == 4, "the last search is taken as it is"
    said = iter([Status.LOST] * 5)
    assert peer_frames.find_start(sequence) is None


def test_a_check_writes_nothing(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(peer_frames, "make_peers", dict)
    peer_frames.main("--check")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """What the peers made of four frames of one knee."""
    try:
        check_peers()
    except UsageError as error:
        pytest.skip(f"no peers ({error})")
    out = CampaignFolder(tmp_path_factory.mktemp("peers") / "out", SETTINGS).path
    told = []
    run_program(out, told.append)
    assert told == [SETTINGS.tests[0].name]
    return out


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_every_peer_follows_the_bone_from_our_first_pose(folder) -> None:
    (done,) = read_peers(folder, SETTINGS.tests)
    always = {"SGBM + WLS + Open3D ICP", "SGBM + GICP", "cv2.rapid + RANSAC"}
    assert always <= set(done.frames) <= {*always, "ViSP, KLT on the model"}
    for name, frames in done.frames.items():
        assert [frame.index for frame in frames] == [1, 2, 3, 4], name
        assert all(frame.ms > 0.0 for frame in frames), name
    for name in set(done.frames) - {"cv2.rapid + RANSAC"}:
        assert all(frame.tre_mm < 1.0 for frame in done.frames[name]), name
    # An outline alone is not enough to follow a bone for long.
    assert done.frames["cv2.rapid + RANSAC"][0].tre_mm < 10.0


@pytest.mark.slow
def test_what_is_done_is_not_done_again(folder) -> None:
    path = file_of(folder, SETTINGS.tests[0])
    before = path.read_bytes(), os.stat(path).st_mtime_ns
    told = []
    run_program(folder, told.append)
    assert told == [SETTINGS.tests[0].name]
    assert (path.read_bytes(), os.stat(path).st_mtime_ns) == before
    assert json.loads(before[0])["seed"] == SETTINGS.tests[0].seed

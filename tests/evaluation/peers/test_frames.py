"""The peers themselves, on a quick look at one case; skipped, and counted, without them."""

import json
import os
from pathlib import Path

import pytest

from navapp.errors import UsageError
from navapp.evaluation.campaign import CampaignFolder
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.peers.program import check_peers, run_program
from navapp.evaluation.peers.scores import file_of, read_peers

SETTINGS = TableSettings((Case("man", "opening", "patient"),), ("bimcc",), 1, 4, 1, is_quick=True)


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

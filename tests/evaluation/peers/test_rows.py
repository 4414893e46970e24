"""Rows of the peers' table, by hand."""

import pytest

from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.peers.rows import make_peer_rows
from tests.evaluation.peers.scored_peers import peer_test
from tests.evaluation.scored import followed, score

MAN = CaseTest(Case("man", "opening", "overlay"), 0, 1)
WOMAN = CaseTest(Case("woman", "opening", "overlay"), 0, 2)
OTHER = CaseTest(Case("man", "opening", "patient"), 0, 3)
OURS = followed(score(0.2), score(1.5), score(0.4, "LOST"), score(None, "LOST"))


def by_name(rows) -> dict:
    return {(row.situation, row.tracker): row for row in rows}


def test_samples_are_pooled_and_situations_are_not() -> None:
    peers = [
        peer_test(MAN, a=[0.2, 0.4]),
        peer_test(WOMAN, a=[1.0, None]),
        peer_test(OTHER, a=[7.0, 9.0]),
    ]
    rows = by_name(make_peer_rows(peers, [], []))
    assert set(rows) == {("overlay", "a"), ("patient", "a")}
    row = rows["overlay", "a"]
    assert (row.n_tests, row.n_frames, row.n_within, row.n_no_pose) == (2, 4, 3, 1)
    assert row.tre_median_mm == pytest.approx(0.4)
    assert rows["patient", "a"].tre_median_mm == pytest.approx(8.0)
    assert rows["patient", "a"].n_within == 0


def test_ours_stands_beside_twice_of_the_same_tests_alone() -> None:
    done = [Done(MAN, {"bimcc": OURS}), Done(OTHER, {"bimcc": OURS})]
    rows = make_peer_rows([peer_test(MAN, a=[0.2])], done, [])
    assert [row.tracker for row in rows] == ["bimcc, OK frames", "bimcc, every pose", "a"]
    shown, every, _ = rows
    assert (shown.n_frames, shown.n_within, shown.n_no_pose) == (4, 1, 2)
    assert shown.tre_median_mm == pytest.approx(0.85)
    assert (every.n_frames, every.n_within, every.n_no_pose) == (4, 2, 1)
    assert every.tre_median_mm == pytest.approx(0.4)
    assert shown.p50_ms is None, "no time was taken"


def test_our_times_are_those_of_the_pass_of_their_own() -> None:
    timed_frames = (
        score(0.2, total_ms=5.0),
        score(0.2, total_ms=7.0),
        score(0.2, total_ms=999.0, is_search=True),
        score(None, "LOST", seen=None, total_ms=1.0),  # nothing was looked for
    )
    timed = [Done(MAN, {"bimcc": followed(*timed_frames)})]
    slow = [Done(MAN, {"bimcc": followed(score(0.2, total_ms=99.0))})]
    rows = by_name(make_peer_rows([peer_test(MAN, a=[0.2])], slow, timed))
    assert rows["overlay", "bimcc, OK frames"].p50_ms == 6.0
    assert rows["overlay", "a"].p50_ms == 30.0


def test_a_peer_that_never_had_a_pose_has_no_error() -> None:
    (row,) = make_peer_rows([peer_test(MAN, a=[None, None])], [], [])
    assert (row.tre_median_mm, row.tre_p95_mm, row.n_no_pose, row.n_within) == (None, None, 2, 0)


def test_other_methods_alone_are_not_ours() -> None:
    rows = make_peer_rows([peer_test(MAN, a=[0.2])], [Done(MAN, {"icp": OURS})], [])
    assert [row.tracker for row in rows] == ["a"]

"""The last sentences of a guided session, and which of them are new."""

from types import SimpleNamespace

import pytest

from navapp.control.recent_events import RecentEvents, list_new_events


def test_all_are_counted_and_the_last_ones_kept() -> None:
    recent = RecentEvents()
    for number in range(100):
        recent.add(f"{number}")
    assert recent.n_told == 100
    assert recent.texts == tuple(f"{number}" for number in range(70, 100))


@pytest.mark.parametrize("n_at_once", [1, 3, 50])
def test_one_who_looks_now_and_then_is_told_each_once_however_many_there_were(
    n_at_once: int,
) -> None:
    recent, heard = RecentEvents(), list[str]()
    n_known = 0
    for number in range(100):
        recent.add(f"{number}")
        if recent.n_told % n_at_once == 0:
            snapshot = SimpleNamespace(events=recent.texts, n_events=recent.n_told)
            heard += list_new_events(snapshot, n_known)
            n_known = recent.n_told
            assert list_new_events(snapshot, n_known) == ()
    # Of fifty at once the first twenty are gone.
    expected = [
        k
        for k in range(recent.n_told - recent.n_told % n_at_once)
        if k % n_at_once >= n_at_once - 30
    ]
    assert heard == [f"{k}" for k in expected]

"""What is told while an evaluation runs."""

import sys

import pytest

from navapp.cli.campaign_progress import CampaignProgress
from navapp.cli.diagnostics import Diagnostics


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def lines_of(capsys, diagnostics=None, n_before: int = 0) -> list[str]:
    """Ten tests, two at a time, and five alone; a minute each call."""
    clock = Clock()
    progress = CampaignProgress(10, 2, diagnostics or Diagnostics(), clock)
    progress.tell(n_before, 15, "")
    for n_done in range(n_before + 1, 16):
        clock.now_s += 60.0
        progress.tell(n_done, 15, f"test {n_done}")
    return capsys.readouterr().err.splitlines()


def test_without_a_terminal_each_tenth_has_a_line(capsys) -> None:
    lines = lines_of(capsys)
    assert len(lines) == 10
    # Ten and twice five are twenty; two of them took two minutes.
    assert lines[0] == "navapp: 2 of 15 tests are done, about 18 min left"
    assert lines[-1] == "navapp: 15 of 15 tests are done"


def test_what_was_done_before_is_told_and_does_not_count_as_fast(capsys) -> None:
    lines = lines_of(capsys, n_before=8)
    assert lines[0] == "navapp: 8 of 15 tests were done before"
    assert lines[1] == "navapp: 10 of 15 tests are done, about 10 min left"


@pytest.mark.parametrize("seconds", [60.0, 600.0])
def test_on_a_terminal_the_bar_tells_the_time_left(capsys, monkeypatch, seconds: float) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    clock = Clock()
    progress = CampaignProgress(2, 1, Diagnostics(), clock)
    progress.tell(0, 2, "")
    clock.now_s += seconds
    progress.tell(1, 2, "a")
    told = capsys.readouterr().err
    assert told.endswith(f" 50 %, about {'60 s' if seconds == 60.0 else '10 min'} left")


def test_quiet_is_quiet_and_verbose_names_each(capsys) -> None:
    assert lines_of(capsys, Diagnostics(is_quiet=True)) == []
    lines = lines_of(capsys, Diagnostics(is_verbose=True))
    assert lines == [f"navapp: {n} of 15: test {n}" for n in range(1, 16)]

"""`navapp evaluate --peers`: where it is refused, and that what it adds stands beside ours."""

import json

import pytest

from navapp.cli.main import run
from navapp.errors import UsageError
from navapp.evaluation import campaign
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.peers import program
from navapp.evaluation.peers.scores import write_peers
from tests.evaluation.peers.scored_peers import peer_test
from tests.evaluation.scored import followed, score

pytestmark = pytest.mark.usefixtures("empty_plots")

ONE = ["--samples", "man", "--stages", "opening", "--situations", "overlay", "--methods", "bimcc",
       "--quick", "--seed", "1"]  # fmt: skip
SETTINGS = TableSettings((Case("man", "opening", "overlay"),), ("bimcc",), 1, 5, 1, is_quick=True)


@pytest.fixture
def ran(monkeypatch) -> list[str]:
    """What ran, one after the other; ours has two frames, and so has the peer."""
    order: list[str] = []

    def follow(folder, settings, *_: object) -> None:
        order.append("ours")
        answers = {"bimcc": followed(score(0.1), score(0.3))}
        for test in settings.tests:
            folder.write(campaign.Done(test, answers), is_timed=False)

    def follow_too(folder, on_done) -> None:
        order.append("peers")
        for test in SETTINGS.tests:
            write_peers(folder, peer_test(test, other=[0.5, 2.0]))
            on_done(test.name)

    monkeypatch.setattr(campaign, "run_campaign", follow)
    monkeypatch.setattr(program, "check_peers", lambda: order.append("check"))
    monkeypatch.setattr(program, "run_program", follow_too)
    return order


def test_the_peers_come_after_ours_and_stand_beside_them(ran, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    assert run(["evaluate", *ONE, "--peers", "--out", str(out)]) == 0
    assert ran == ["check", "ours", "peers"]
    assert "other: 1 of 2 frames within 1 mm" in capsys.readouterr().out
    rows = json.loads((out / "evaluate.json").read_text())["peers"]
    assert [row["tracker"] for row in rows] == ["bimcc, OK frames", "bimcc, every pose", "other"]
    assert rows[2]["tre_median_mm"] == 1.25
    assert "## Peers on the same frames" in (out / "tables.md").read_text()
    assert "<h2>Peers on the same frames</h2>" in (out / "report.html").read_text()
    assert len((out / "peers.csv").read_text().splitlines()) == 3


@pytest.mark.release
def test_they_are_kept(ran, tmp_path) -> None:
    out = tmp_path / "out"
    for options in (["--peers"], ["--peers"], []):
        assert run(["--quiet", "evaluate", *ONE, *options, "--out", str(out)]) == 0
    assert ran == ["check", "ours", "peers", "check", "ours", "peers", "ours"]
    assert "| other |" in (out / "tables.md").read_text()


def test_without_them_nothing_is_said_of_peers(ran, tmp_path) -> None:
    out = tmp_path / "out"
    assert run(["--quiet", "evaluate", *ONE, "--out", str(out)]) == 0
    assert ran == ["ours"]
    assert json.loads((out / "evaluate.json").read_text())["peers"] == []
    assert "Peers" not in (out / "tables.md").read_text()
    assert not (out / "peers.csv").exists()


def test_missing_they_are_refused_before_anything_is_run(
    ran, tmp_path, capsys, monkeypatch
) -> None:
    def refuse() -> None:
        raise UsageError("the peers' environment is missing", remedy="run `make peers` in /here")

    monkeypatch.setattr(program, "check_peers", refuse)
    out = tmp_path / "out"
    assert run(["--quiet", "evaluate", *ONE, "--peers", "--out", str(out)]) == 2
    assert "environment is missing: run `make peers` in /here" in capsys.readouterr().err
    assert ran == []
    assert not out.exists()


@pytest.mark.parametrize("options", [["--stress"], ["--ablation"], ["--recording", "pairs"]])
def test_they_are_of_the_tables_alone(ran, tmp_path, capsys, options) -> None:
    assert run(["--quiet", "evaluate", *options, "--peers", "--out", str(tmp_path / "out")]) == 2
    assert (
        f"--peers cannot be used with {options[0]}: leave one of them out"
        in capsys.readouterr().err
    )
    assert ran == []

"""The peers' section and their CSV."""

import csv
import io

from navapp.evaluation.paper.cases import Case, CaseTest
from navapp.evaluation.peers.rows import make_peer_rows
from navapp.evaluation.peers.tables import format_peers, make_peer_csv
from tests.evaluation.peers.scored_peers import peer_test

TEST = CaseTest(Case("woman", "drilling", "patient"), 4, 7)


def test_a_row_reads_as_the_figures_are() -> None:
    peers = [peer_test(TEST, icp=[0.25, 0.25, 4.0, None], none=[None, None, None, None])]
    lines = format_peers(make_peer_rows(peers, [], []))
    assert lines[0] == "## Peers on the same frames"
    table = [line for line in lines if line.startswith("| drilling")]
    assert table == [
        "| drilling | the patient moves | icp | 1 | 4 | 0.25 | 3.62 | 50.0 % | 25.0 % | 30 |",
        "| drilling | the patient moves | none | 1 | 4 | - | - | 0.0 % | 100.0 % | 30 |",
    ]
    text = " ".join(lines)
    assert "starts from our first pose that is OK" in text
    assert "never helped again" in text


def test_without_peers_there_is_no_section() -> None:
    assert format_peers([]) == []


def test_every_frame_is_in_the_csv() -> None:
    rows = list(csv.DictReader(io.StringIO(make_peer_csv([peer_test(TEST, a=[0.5, None])]))))
    assert [(row["index"], row["tre_mm"], row["ms"]) for row in rows] == [
        ("1", "0.5", "30.0"), ("2", "", "30.0"),
    ]  # fmt: skip
    assert {
        (row["sample"], row["stage"], row["test"], row["seed"], row["peer"]) for row in rows
    } == {("woman", "drilling", "4", "7", "a")}

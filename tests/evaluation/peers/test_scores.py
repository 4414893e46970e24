"""The peers' files: read as they were written, and never half."""

import pytest

from navapp.errors import InputError
from navapp.evaluation.paper.cases import ALL_CASES, list_tests
from navapp.evaluation.peers.scores import file_of, read_peers, write_peers
from tests.evaluation.peers.scored_peers import peer_test

TESTS = tuple(list_tests(ALL_CASES[:1], 3, 1))


def test_what_is_done_is_read_in_the_order_of_the_tests(tmp_path) -> None:
    last, first = peer_test(TESTS[2], a=[0.5, None]), peer_test(TESTS[0], a=[0.1], b=[None])
    write_peers(tmp_path, last)
    write_peers(tmp_path, first)
    assert read_peers(tmp_path, TESTS) == [first, last]
    assert read_peers(tmp_path, TESTS[1:2]) == []


def test_without_peers_there_is_nothing_to_read(tmp_path) -> None:
    assert read_peers(tmp_path, TESTS) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"peers": []}', '{"peers": {"a": [{"index": 1}]}}', '{"peers": 1}']
)
def test_a_damaged_file_is_named(tmp_path, text) -> None:
    write_peers(tmp_path, peer_test(TESTS[0], a=[0.1]))
    path = file_of(tmp_path, TESTS[0])
    path.write_text(text)
    with pytest.raises(InputError, match=rf"{path.name} is damaged: delete it, and run again"):
        read_peers(tmp_path, TESTS)

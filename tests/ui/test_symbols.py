import dataclasses

import pytest

from navapp.ui.symbols import ASCII, UNICODE, Symbols, choose_symbols


@pytest.mark.parametrize(
    ("encoding", "environment", "expected"),
    [
        ("utf-8", {}, UNICODE),
        ("UTF8", {"LANG": "de_DE.UTF-8"}, UNICODE),
        ("utf-8", {"LANG": "C.UTF-8"}, UNICODE),
        ("latin-1", {"LANG": "de_DE"}, ASCII),
        (None, {}, ASCII),
        # Python reports UTF-8 in these, the terminal may know nothing of it.
        ("utf-8", {"LC_ALL": "C", "LANG": "de_DE.UTF-8"}, ASCII),
        ("utf-8", {"LANG": "POSIX"}, ASCII),
    ],
)
def test_the_set_follows_the_terminal(
    encoding: str | None, environment: dict[str, str], expected: Symbols
) -> None:
    assert choose_symbols(encoding, environment) is expected


def test_the_plain_set_is_ascii() -> None:
    assert all(text.isascii() for text in dataclasses.astuple(ASCII))


@pytest.mark.parametrize("symbols", [UNICODE, ASCII])
def test_the_marks_of_the_levels_differ(symbols: Symbols) -> None:
    assert len({symbols.ok, symbols.attention, symbols.bad, symbols.absent}) == 4

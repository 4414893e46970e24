"""Options of a replay that cannot be meant are refused before anything is read."""

import pytest

from navapp.cli.main import run
from navapp.cli.replay import _layers


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--png"], ("--png", "--overlay DIR")),
        (["--png", "--video", "o.mp4"], ("--png", "--overlay DIR")),
        (["--layers", "bone,hologram"], ("no layer 'hologram'", "bone, removal")),
        (["--layers", "curves"], ("no layer 'curves'", "risks")),
    ],
)
def test_options_that_do_not_fit(capsys, options, words) -> None:
    assert run(["--quiet", "replay", "nowhere", *options]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    for word in words:
        assert word in line


@pytest.mark.parametrize(
    ("given", "layers"),
    [
        (None, None),
        ("bone", ("bone",)),
        (" planes, bone ,", ("planes", "bone")),
        ("", ()),
    ],
)
def test_layers_are_names_with_commas(given, layers) -> None:
    assert _layers(given) == layers

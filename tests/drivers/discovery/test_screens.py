import os
import subprocess
from types import SimpleNamespace

import pytest

from drivers.discovery import list_screens
from drivers.window_outputs import Output
from tests.x_servers import two_monitors


@pytest.mark.slow
def test_two_outputs_are_listed_by_name_with_place_and_size(tmp_path, monkeypatch):
    with two_monitors(tmp_path) as display:
        monkeypatch.setenv("DISPLAY", display)
        listing = list_screens()
    assert listing.unseen == ()
    assert listing.found == (
        Output(0, "DUMMY0", 0, 0, 960, 540),
        Output(1, "DUMMY1", 960, 0, 800, 600),
    )


def test_without_a_server_a_sentence_says_what_to_do(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    listing = list_screens()
    assert listing.found == ()
    (why,) = listing.unseen
    assert why.problem.startswith("there is no X11 screen to open a window on")
    assert "DISPLAY" in why.remedy


def test_a_driver_that_draws_into_nothing_is_no_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    (why,) = list_screens().unseen
    assert "SDL would draw with 'dummy'" in why.problem


def test_without_the_package_a_sentence_says_what_to_do(tmp_path, monkeypatch):
    (tmp_path / "pygame.py").write_text("raise ImportError('libSDL is missing')")
    put_first(tmp_path, monkeypatch)
    (why,) = list_screens().unseen
    assert why.problem == "a window needs the package pygame-ce (libSDL is missing)"


def test_a_library_that_ends_the_process_is_no_error_here(tmp_path, monkeypatch):
    (tmp_path / "pygame.py").write_text("import os; os.write(2, b'bang'); os.abort()")
    put_first(tmp_path, monkeypatch)
    (why,) = list_screens().unseen
    assert why.problem == "SDL ended while it was asked (bang)"


def test_a_server_that_hangs_is_not_waited_for(monkeypatch):
    def never(command, *, timeout, **options):
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", never)
    (why,) = list_screens().unseen
    assert "does not answer within 15 s" in why.problem


def test_outputs_of_one_name_cannot_be_chosen(monkeypatch):
    one = '{"index": %d, "name": "TV", "left": 0, "top": 0, "width": 8, "height": 6}'
    answer = SimpleNamespace(stdout=f'{{"outputs": [{one % 0}, {one % 1}]}}', stderr="")
    monkeypatch.setattr(subprocess, "run", lambda command, **options: answer)
    listing = list_screens()
    assert len(listing.found) == 2
    assert [why.problem for why in listing.unseen] == [
        "2 outputs are called 'TV', so that none can be chosen by name"
    ]


def put_first(folder, monkeypatch):
    """A child process finds modules in this folder before all others."""
    paths = [str(folder), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))

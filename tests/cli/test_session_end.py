"""What is said when a session with a screen has ended."""

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.session_end import KeptFiles


def told(kept, capsys, *, n_frames=7, is_whole=True):
    kept.tell(n_frames, is_whole=is_whole, diagnostics=Diagnostics())
    return capsys.readouterr()


def test_where_a_recording_is_and_how_large(tmp_path, capsys):
    folder = tmp_path / "session"
    kept = KeptFiles.begin(str(folder), tmp_path / "navapp.log")
    folder.mkdir()
    (folder / "left_000000.png").write_bytes(bytes(3_000_000))
    said = told(kept, capsys)
    assert said.out.startswith(f"recorded session: {folder} (7 frames, 3 MB)")
    assert f"navapp replay {folder}" in said.out
    assert said.err == ""


def test_a_recording_that_was_stopped_is_said_to_be_so(tmp_path, capsys):
    kept = KeptFiles.begin(str(tmp_path), tmp_path / "navapp.log")
    said = told(kept, capsys, is_whole=False)
    assert "stopped before the session's end" in said.err
    # It holds fewer frames than the session had.
    assert "7 frames" not in said.out


def test_a_recording_without_frames_is_not_claimed(tmp_path, capsys):
    said = told(KeptFiles.begin(str(tmp_path / "none"), tmp_path / "navapp.log"), capsys)
    assert said.out == ""
    assert "no frame came" in said.err


def test_the_log_is_named_when_something_was_added(tmp_path, capsys):
    log = tmp_path / "navapp.log"
    log.write_text("of an earlier session\n")
    kept = KeptFiles.begin(None, log)
    assert told(kept, capsys).out == ""
    log.write_text("of an earlier session\na library says hello\n")
    assert told(kept, capsys).out == f"messages of libraries: {log}\n"

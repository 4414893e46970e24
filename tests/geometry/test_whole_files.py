import os
from pathlib import Path

import pytest

from navapp.geometry.whole_files import write_whole


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "kept.bin"
    write_whole(path, b"old")

    def no_space(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert [entry.name for entry in tmp_path.iterdir()] == ["kept.bin"]
    assert path.read_bytes() == b"old"


def test_a_folder_in_the_way_leaves_nothing_behind(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_whole(tmp_path / "taken", b"new")
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken"]


def test_a_written_file_can_be_read_by_others(tmp_path):
    write_whole(tmp_path / "a", b"1")
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o644


def test_a_pipe_or_a_device_is_written_to_and_stays(tmp_path):
    """As root a file would take the place of /dev/null, for all programs of the machine."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_whole(pipe, b"told")
        assert pipe.is_fifo()
        assert os.read(reading, 10) == b"told"
    finally:
        os.close(reading)
    write_whole(os.devnull, b"nothing")
    assert Path(os.devnull).is_char_device()

import cv2
import numpy as np
import pytest

from drivers.session_files import SessionWriter, read_frame_table
from navapp.errors import InputError, SequenceError
from tests.drivers.recordings import frame

HEADER = "sequence,captured_ns,skew_ns,left,right\n"


def write(folder, *lines, end="\n"):
    folder.mkdir(exist_ok=True)
    (folder / "frames.csv").write_text(HEADER + "\n".join(lines) + end, encoding="utf-8")
    return folder


def test_what_is_written_is_read_back(tmp_path):
    folder = tmp_path / "deep" / "session"
    frames = [frame(3, 1_000, -50), frame(4, 2_000), frame(7, 2_500)]
    with SessionWriter(folder) as writer:
        for number, one in enumerate(frames):
            writer.add(one, with_pictures=number != 1)
    rows = read_frame_table(folder)
    assert [(row.sequence, row.captured_ns, row.skew_ns) for row in rows] == [
        (3, 1_000, -50),
        (4, 2_000, 0),
        (7, 2_500, 0),
    ]
    assert rows[0].left == folder / "left_000003.png"
    assert (rows[1].left, rows[1].right) == (None, None)
    assert np.array_equal(cv2.imread(str(rows[2].right)), frames[2].right)


def test_every_line_is_on_disk_at_once(tmp_path):
    writer = SessionWriter(tmp_path)
    writer.add(frame(0, 5), with_pictures=False)
    assert (tmp_path / "frames.csv").read_text() == HEADER + "0,5,0,,\n"
    writer.close()
    writer.close()


def test_pictures_are_there_before_their_line(tmp_path, monkeypatch):
    writer = SessionWriter(tmp_path)
    (tmp_path / "right_000001.png").mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        writer.add(frame(1, 5), with_pictures=True)
    writer.close()
    assert read_frame_table(tmp_path) == ()


@pytest.mark.parametrize("name", ["frames.csv", "left_000000.png", "right12.jpg"])
def test_folder_that_holds_a_session_is_refused_and_kept(tmp_path, name):
    (tmp_path / name).write_text("precious")
    with pytest.raises(InputError, match="already holds a session"):
        SessionWriter(tmp_path)
    assert (tmp_path / name).read_text() == "precious"


def test_other_files_of_the_session_may_be_there_already(tmp_path):
    (tmp_path / "rig.yml").write_text("x")
    SessionWriter(tmp_path).close()
    assert read_frame_table(tmp_path) == ()


def test_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot be written"):
        SessionWriter(tmp_path / "file" / "session")


@pytest.mark.parametrize("cut", ["2,3000,0,left_2.png,rig", "2,30", "2,3000,0,l.png,r.png"])
def test_truncated_last_line_is_noticed(tmp_path, cut):
    folder = write(tmp_path, "1,2000,0,l.png,r.png", cut, end="")
    with pytest.raises(SequenceError, match=r"frames\.csv breaks off in line 3: delete that line"):
        read_frame_table(folder)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["1,x,0,,", "2,3,0,,"], "damaged in line 2"),
        (["1,2,0,a.png,", "2,3,0,,"], "damaged in line 2"),
        (["", "2,3,0,,"], "damaged in line 2"),
        (["1,2,0,../a.png,b.png", "2,3,0,,"], "damaged in line 2"),
        (["1,2,0,/a.png,b.png", "2,3,0,,"], "damaged in line 2"),
        (["1,2,0,,", "2,1,0,,"], "goes backwards in line 3"),
        (["2,2,0,,", "2,3,0,,"], "goes backwards in line 3"),
    ],
)
def test_damaged_lines_are_named(tmp_path, lines, message):
    with pytest.raises(SequenceError, match=message):
        read_frame_table(write(tmp_path, *lines))


def test_repeated_capture_time_of_a_stalled_camera_is_no_damage(tmp_path):
    rows = read_frame_table(write(tmp_path, "1,2,0,,", "2,2,0,,"))
    assert [row.captured_ns for row in rows] == [2, 2]


def test_missing_table_and_missing_header(tmp_path):
    with pytest.raises(SequenceError, match="cannot be read"):
        read_frame_table(tmp_path)
    (tmp_path / "frames.csv").write_text("")
    with pytest.raises(SequenceError, match="no header"):
        read_frame_table(tmp_path)
    (tmp_path / "frames.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SequenceError, match="cannot be read"):
        read_frame_table(tmp_path)

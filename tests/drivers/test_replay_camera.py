import itertools

import numpy as np
import pytest

from drivers.clock import ManualClock
from drivers.replay_camera import ReplayCamera, ReplaySettings
from drivers.session_files import SessionWriter
from navapp.errors import (
    DeviceLost,
    EndOfSequence,
    InputError,
    SequenceError,
    UnsupportedControl,
    UsageError,
)
from tests.drivers.recordings import (
    HEIGHT,
    WIDTH,
    frame,
    number_of,
    picture,
    write_pairs,
    write_picture,
    write_video,
)


def opened(source, clock=None, rig_id="", **settings):
    camera = ReplayCamera(source, clock or ManualClock(), ReplaySettings(**settings), rig_id=rig_id)
    camera.open()
    return camera


def read_all(camera):
    def read():
        try:
            return camera.read(0.0)
        except EndOfSequence:
            return None

    return list(iter(read, None))


def indices(camera):
    return [one.source_index for one in read_all(camera)]


@pytest.fixture
def folder(tmp_path):
    return write_pairs(tmp_path / "pairs", [2, 3, 5])


@pytest.fixture
def session(tmp_path):
    with SessionWriter(tmp_path / "session") as writer:
        for number, captured_ns in ((4, 10**12), (5, 10**12 + 70), (9, 10**12 + 100)):
            writer.add(frame(number, captured_ns, skew_ns=number), with_pictures=True)
    return tmp_path / "session"


# Plain folders


def test_folder_is_read_in_order_of_its_numbers(folder):
    camera = opened(folder, rig_id="abc")
    frames = read_all(camera)
    assert [one.source_index for one in frames] == [2, 3, 5]
    assert [one.index for one in frames] == [2, 3, 5]
    assert [one.sequence for one in frames] == [2, 3, 5]
    assert [number_of(one.left) for one in frames] == [2.0, 3.0, 5.0]
    assert [number_of(one.right) for one in frames] == [2.5, 3.5, 5.5]
    assert {one.rig_id for one in frames} == {"abc"}


def test_numbers_count_and_not_names(tmp_path):
    folder = write_pairs(tmp_path, [2, 10, 11], "{}{}.png")
    assert indices(opened(folder)) == [2, 10, 11]


@pytest.mark.parametrize("pattern", ["{}_{:04d}.jpg", "{}-{}.jpeg", "{}{:02d}.bmp", "{}_{}.tiff"])
def test_usual_names_and_formats_are_found(tmp_path, pattern):
    folder = write_pairs(tmp_path, [0, 1], pattern)
    assert [number_of(one.left) for one in read_all(opened(folder))] == [0.0, 1.0]


def test_upper_case_names_and_unequal_digits_are_pairs(tmp_path):
    write_picture(tmp_path / "LEFT_7.PNG", picture(7, "left"))
    write_picture(tmp_path / "Right-007.png", picture(7, "right"))
    assert indices(opened(tmp_path)) == [7]


def test_other_files_are_ignored(folder):
    for name in ("bone_mask_left_0000.png", "depth_left_0000.png", "left_mask_0001.png"):
        write_picture(folder / name, picture(0, "left"))
    (folder / "truth.json").write_text("{}")
    (folder / "left_intrinsics.yml").write_text("x")
    (folder / "left_0009.txt").write_text("x")
    assert indices(opened(folder)) == [2, 3, 5]


def test_clock_and_time_stamps_step_by_the_period(folder):
    clock = ManualClock()
    camera = opened(folder, clock, rate_hz=10.0)
    times_ns = []
    for one in (camera.read(0.0) for _ in range(3)):
        times_ns.append(one.captured_ns)
        assert clock.now_ns() == one.captured_ns == one.received_ns
    assert times_ns == [0, 100_000_000, 200_000_000]
    assert camera.info.measured_rate_hz == pytest.approx(10.0)


def test_pingpong_turns_at_both_ends_without_repeating_them(folder):
    camera = opened(folder, order="pingpong", n_frames=7)
    frames = read_all(camera)
    assert [one.source_index for one in frames] == [2, 3, 5, 3, 2, 3, 5]
    assert [one.sequence for one in frames] == list(range(7))
    assert all(a.captured_ns < b.captured_ns for a, b in itertools.pairwise(frames))
    assert camera.info.n_frames == 7


def test_pingpong_without_an_end_goes_there_and_back_once(folder):
    camera = opened(folder, order="pingpong")
    assert camera.info.n_frames == 5
    assert indices(camera) == [2, 3, 5, 3, 2]


@pytest.mark.parametrize(("n_frames", "expected"), [(1, [2]), (2, [2, 3]), (9, [2, 3, 5])])
def test_forward_ends_after_n_frames_or_at_the_end(folder, n_frames, expected):
    camera = opened(folder, n_frames=n_frames)
    assert camera.info.n_frames == len(expected)
    assert indices(camera) == expected


def test_start_is_a_picture_number(folder):
    assert indices(opened(folder, start=3)) == [3, 5]
    assert indices(opened(folder, start=4)) == [5]
    assert indices(opened(folder, start=3, order="pingpong", n_frames=4)) == [3, 5, 3, 5]
    assert indices(opened(folder, start=5, order="pingpong", n_frames=3)) == [5, 5, 5]
    with pytest.raises(SequenceError, match="ends at number 5, before the start 6"):
        opened(folder, start=6)


def test_reopening_starts_again(folder):
    camera = opened(folder)
    camera.read(0.0)
    camera.close()
    camera.open()
    assert camera.read(0.0).source_index == 2


def test_grey_pictures_stay_grey(tmp_path):
    for eye in ("left", "right"):
        write_picture(tmp_path / f"{eye}_0.png", picture(3, eye, is_grey=True))
    assert opened(tmp_path).read(0.0).left.shape == (HEIGHT, WIDTH)


def test_pictures_are_not_turned_by_their_exif_tag(tmp_path):
    write_pairs(tmp_path, [0], "{}_{}.jpg")
    # A minimal EXIF block with orientation 6 (a quarter turn) behind the start marker.
    exif = bytes.fromhex("4578696600004d4d002a00000008000101120003000000010006000000000000")
    segment = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif
    for eye in ("left", "right"):
        path = tmp_path / f"{eye}_0.jpg"
        data = path.read_bytes()
        path.write_bytes(data[:2] + segment + data[2:])
    assert opened(tmp_path).read(0.0).left.shape == (HEIGHT, WIDTH, 3)


def test_truncated_picture_in_the_middle_is_named_when_it_is_read(folder):
    path = folder / "right_0003.png"
    path.write_bytes(path.read_bytes()[:-8])
    camera = opened(folder)
    camera.read(0.0)
    with pytest.raises(SequenceError, match=r"right_0003\.png is damaged, truncated"):
        camera.read(0.0)


@pytest.mark.parametrize("share", [0.5, 0.95, 0.999])
def test_truncated_jpeg_is_noticed(tmp_path, share):
    write_pairs(tmp_path, [0], "{}_{}.jpg")
    rng = np.random.default_rng(0)
    path = tmp_path / "left_0.jpg"
    write_picture(path, rng.integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(SequenceError, match=r"left_0\.jpg is damaged"):
        opened(tmp_path)


def test_empty_file_is_noticed_on_opening(folder):
    (folder / "left_0005.png").write_bytes(b"")
    with pytest.raises(SequenceError, match=r"left_0005\.png is empty"):
        opened(folder)


def test_file_that_vanishes_meanwhile_is_named(folder):
    camera = opened(folder)
    (folder / "left_0002.png").unlink()
    with pytest.raises(SequenceError, match=r"left_0002\.png cannot be read"):
        camera.read(0.0)


def test_pictures_of_different_sizes_are_refused(folder):
    for eye in ("left", "right"):
        write_picture(folder / f"{eye}_0003.png", picture(3, eye)[:-2])
    camera = opened(folder)
    camera.read(0.0)
    with pytest.raises(SequenceError, match=r"pair 3 .* differs in size .* 48x30 against 48x32"):
        camera.read(0.0)


@pytest.mark.parametrize("change", [lambda p: p[:-2], lambda p: np.ascontiguousarray(p[..., 0])])
def test_unlike_eyes_are_refused(folder, change):
    write_picture(folder / "right_0002.png", change(picture(2, "right")))
    with pytest.raises(SequenceError, match="left and right of pair 2"):
        opened(folder)


def test_odd_numbers_are_named(folder):
    for name in ("left_0008.png", "left_0009.png", "right_0001.png"):
        write_picture(folder / name, picture(0, "left"))
    with pytest.raises(SequenceError, match="without a partner: left 8, 9 and right 1: add"):
        opened(folder)


def test_many_odd_numbers_are_counted(folder):
    for number in range(10, 20):
        write_picture(folder / f"left_{number}.png", picture(0, "left"))
    with pytest.raises(SequenceError, match="left 10, 11, 12, 13, 14 and 5 more"):
        opened(folder)


def test_two_pictures_of_one_number_are_refused(folder):
    write_picture(folder / "left_2.jpg", picture(2, "left"))
    with pytest.raises(SequenceError, match="two pictures number 2"):
        opened(folder)


def test_empty_folder_and_missing_path_say_what_to_do(tmp_path):
    with pytest.raises(SequenceError, match=r"holds no stereo pairs: .*left_0000\.png"):
        opened(tmp_path)
    with pytest.raises(SequenceError, match=r"there is no recording .*nowhere"):
        opened(tmp_path / "nowhere")


# Session folders


def test_session_keeps_its_times_and_skew(session):
    clock = ManualClock()
    frames = read_all(opened(session, clock))
    assert [one.captured_ns - 10**12 for one in frames] == [0, 70, 100]
    assert [one.skew_ns for one in frames] == [4, 5, 9]
    assert [one.source_index for one in frames] == [4, 5, 9]
    assert [number_of(one.left) for one in frames] == [4.0, 5.0, 9.0]
    assert clock.now_ns() == 10**12 + 100


def test_session_walked_backwards_still_runs_forwards_in_time(session):
    frames = read_all(opened(session, order="pingpong", n_frames=6))
    assert [one.source_index for one in frames] == [4, 5, 9, 5, 4, 5]
    assert [one.captured_ns - 10**12 for one in frames] == [0, 70, 100, 130, 200, 270]


def test_single_recorded_pair_again_and_again_runs_forwards_in_time(session):
    frames = read_all(opened(session, order="pingpong", n_frames=3, start=9))
    assert np.diff([one.captured_ns for one in frames]).min() > 0


def test_half_written_sessions_are_noticed(session):
    (session / "right_000005.png").rename(session / "hidden")
    with pytest.raises(SequenceError, match=r"right_000005\.png is missing"):
        opened(session)
    (session / "hidden").rename(session / "right_000005.png")
    table = session / "frames.csv"
    table.write_bytes(table.read_bytes()[:-7])
    with pytest.raises(SequenceError, match="breaks off in line 4"):
        opened(session)


def test_session_without_pictures_cannot_be_replayed(tmp_path):
    with SessionWriter(tmp_path) as writer:
        writer.add(frame(0, 5), with_pictures=False)
    with pytest.raises(SequenceError, match="holds no pictures: record it with pictures"):
        opened(tmp_path)


# Videos


def test_two_videos_are_a_pair_in_any_order(tmp_path):
    left = write_video(tmp_path / "l.avi", ("left",), 6)
    right = write_video(tmp_path / "r.avi", ("right",), 6)
    camera = opened(f"{left},{right}", order="pingpong", n_frames=9, start=2)
    frames = read_all(camera)
    assert [one.source_index for one in frames] == [2, 3, 4, 5, 4, 3, 2, 3, 4]
    assert [number_of(one.left) for one in frames] == [2, 3, 4, 5, 4, 3, 2, 3, 4]
    assert [number_of(one.right) for one in frames] == [
        n + 0.5 for n in (2, 3, 4, 5, 4, 3, 2, 3, 4)
    ]
    camera.close()


def test_rate_of_a_video_is_its_own(tmp_path):
    video = write_video(tmp_path / "both.avi", ("left", "right"), 3, rate_hz=25.0)
    camera = opened(video, is_side_by_side=True, rate_hz=15.0)
    assert [one.captured_ns for one in read_all(camera)] == [0, 40_000_000, 80_000_000]


def test_one_video_is_split_down_the_middle(tmp_path):
    video = write_video(tmp_path / "both.avi", ("left", "right"), 4)
    frames = read_all(opened(video, is_side_by_side=True))
    assert frames[0].left.shape == (HEIGHT, WIDTH, 3)
    assert [(number_of(one.left), number_of(one.right)) for one in frames] == [
        (0.0, 0.5),
        (1.0, 1.5),
        (2.0, 2.5),
        (3.0, 3.5),
    ]
    assert frames[0].left.flags.c_contiguous


def test_videos_of_different_lengths_are_refused(tmp_path):
    left = write_video(tmp_path / "l.avi", ("left",), 6)
    right = write_video(tmp_path / "r.avi", ("right",), 5)
    with pytest.raises(SequenceError, match="differ in length: 6 against 5 frames"):
        opened(f"{left},{right}")


def test_truncated_video_is_noticed(tmp_path):
    video = write_video(tmp_path / "both.avi", ("left", "right"), 20)
    data = video.read_bytes()
    video.write_bytes(data[: len(data) * 3 // 4])
    with pytest.raises(SequenceError, match=r"truncated: \d+ of 20 frames"):
        opened(video, is_side_by_side=True)


def test_unreadable_and_missing_videos_are_named(tmp_path):
    good = write_video(tmp_path / "l.avi", ("left",), 2)
    bad = tmp_path / "r.mp4"
    bad.write_bytes(b"no video")
    with pytest.raises(SequenceError, match=r"r\.mp4 cannot be opened"):
        opened(f"{good},{bad}")
    with pytest.raises(SequenceError, match=r"gone\.mp4 does not exist"):
        opened(f"{good},{tmp_path / 'gone.mp4'}")


def test_video_without_partner_and_split_of_a_folder_are_wrong_usage(tmp_path, folder):
    video = write_video(tmp_path / "l.avi", ("left",), 2)
    with pytest.raises(UsageError, match="one video for two eyes: give LEFT,RIGHT"):
        opened(video)
    with pytest.raises(UsageError, match="cannot be split"):
        opened(folder, is_side_by_side=True)


# The rest


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"order": "sideways"}, "unknown order 'sideways'"),
        ({"n_frames": 0}, "0 frames"),
        ({"rate_hz": 0.0}, "a rate of 0 Hz"),
        ({"rate_hz": float("nan")}, "a rate of nan Hz"),
        ({"rate_hz": float("inf")}, "a rate of inf Hz"),
    ],
)
def test_wrong_settings_are_refused(settings, words):
    with pytest.raises(UsageError, match=words):
        ReplaySettings(**settings)


def test_recording_has_no_controls_and_must_be_open(folder):
    camera = ReplayCamera(folder, ManualClock())
    with pytest.raises(UnsupportedControl, match="exposure_ms"):
        camera.set("exposure_ms", 8.0)
    with pytest.raises(DeviceLost):
        camera.read(0.0)


def test_every_refusal_is_an_input_error_or_wrong_usage():
    assert SequenceError.exit_code == InputError.exit_code == 3
    assert UsageError.exit_code == 2

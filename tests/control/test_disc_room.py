"""A recording's rate and room, and its end before the disc is full; on a disc that is made up."""

from dataclasses import replace
from pathlib import Path

import pytest

from navapp.control.disc_room import DiscRoom, RoomLeft, check_room_to_begin, measure_free_bytes
from navapp.control.event_log import SessionHooks
from navapp.control.recorder import SessionRecorder
from navapp.control.states import DeviceHealth
from navapp.errors import InputError
from tests.control.fakes import Bench


class Disc:
    """A disc of a given room, and a writer that fills it."""

    def __init__(self, free_bytes: int) -> None:
        self.free_bytes, self.written, self.now_ns, self.n_looks = free_bytes, 0, 0, 0

    def measure_free(self, _folder: Path) -> int:
        self.n_looks += 1
        return self.free_bytes - self.written

    def go_on(self, seconds: float, n_bytes: int) -> None:
        self.now_ns += round(seconds * 1e9)
        self.written += n_bytes

    def room(self, folder: Path = Path("sessions/1")) -> DiscRoom:
        return DiscRoom(
            folder,
            lambda: self.written,
            measure_free=self.measure_free,
            now_ns=lambda: self.now_ns,
        )


class NoFrames:
    def add(self, frame: object, with_pictures: bool) -> None: ...

    def close(self) -> None: ...


def test_rate_and_room_are_those_of_the_last_seconds() -> None:
    disc = Disc(free_bytes=6_500_000_000)
    room = disc.room()
    assert room.left.words == "0 MB written, 6.5 GB free"
    for _ in range(30):
        disc.go_on(1.0, 5_000_000)
        room.check()
    for _ in range(10):
        disc.go_on(1.0, 20_000_000)
        room.check()
    left = room.left
    assert left.written_bytes == 350_000_000
    assert left.bytes_per_s == pytest.approx(20e6)
    assert left.minutes_left == pytest.approx((6.5e9 - 350e6 - 500e6) / 20e6 / 60.0)
    assert left.words == "350 MB written, 20.0 MB/s, 6.2 GB free, room for 5 min"


def test_much_room_is_told_in_hours() -> None:
    left = RoomLeft(written_bytes=0, free_bytes=46_500_000_000, bytes_per_s=1e6)
    assert left.words.endswith("46.5 GB free, room for 13 h")


def test_the_disc_is_looked_at_once_a_second() -> None:
    disc = Disc(free_bytes=10**10)
    room = disc.room()
    for _ in range(30):
        disc.go_on(0.1, 0)
        room.check()
    assert disc.n_looks == pytest.approx(1 + 3, abs=1)


def test_a_recording_that_writes_nothing_has_room_without_an_end() -> None:
    disc = Disc(free_bytes=10**10)
    room = disc.room()
    disc.go_on(2.0, 0)
    room.check()
    assert room.left.minutes_left is None
    assert "room for" not in room.left.words


def test_a_recording_does_not_begin_on_a_disc_that_is_nearly_full(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"only 1\.9 GB are free .* 2 GB are needed"):
        check_room_to_begin(tmp_path / "new", lambda folder: 1_900_000_000)
    check_room_to_begin(tmp_path / "new", lambda folder: 2_000_000_000)


def test_the_disc_of_a_folder_that_is_not_there_yet_is_that_of_its_parent(tmp_path: Path) -> None:
    assert measure_free_bytes(tmp_path / "a" / "b") > 0


def recorded(tmp_path: Path, disc: Disc) -> tuple[Bench, SessionRecorder]:
    recorder = SessionRecorder(tmp_path, NoFrames(), room=disc.room(tmp_path))
    hooks = SessionHooks(on_frame=(recorder.on_frame,), recorder=recorder)
    return Bench(hooks=hooks), recorder


def line_of(bench: Bench):
    (line,) = (line for line in bench.snapshot.devices if line.kind == "recording")
    return line


def test_the_devices_tell_the_recording(tmp_path: Path) -> None:
    disc = Disc(free_bytes=10**11)
    bench, recorder = recorded(tmp_path, disc)
    bench.frames(1)
    disc.go_on(2.0, 30_000_000)
    bench.frames(1)
    line = line_of(bench)
    assert (line.name, line.health) == (str(tmp_path), DeviceHealth.OK)
    assert line.detail.startswith("30 MB written, 15.0 MB/s, 100.0 GB free")
    recorder.close()


def test_little_time_left_is_told_as_trouble(tmp_path: Path) -> None:
    disc = Disc(free_bytes=1_000_000_000)
    bench, recorder = recorded(tmp_path, disc)
    disc.go_on(2.0, 30_000_000)
    bench.frames(1)
    assert line_of(bench).health is DeviceHealth.TROUBLE
    assert "room for 1 min" in line_of(bench).detail
    recorder.close()


def test_a_recording_is_stopped_before_the_disc_is_full_and_the_session_goes_on(
    tmp_path: Path,
) -> None:
    disc = Disc(free_bytes=600_000_000)
    bench, recorder = recorded(tmp_path, disc)
    bench.frames(1)
    disc.go_on(2.0, 150_000_000)
    bench.frames(3)
    assert bench.state == "ready"
    told = [event.text for event in bench.snapshot.events if event.kind == "recording"]
    assert len(told) == 1
    assert told[0].startswith(f"recording stopped: the disc of {tmp_path} is nearly full, 0.5 GB")
    assert "free room on that disc" in told[0]
    assert line_of(bench).health is DeviceHealth.TROUBLE
    assert "recording stopped" in line_of(bench).detail
    assert not recorder.is_running
    assert len((tmp_path / "poses.jsonl").read_text().splitlines()) == 1
    recorder.close()


def test_the_title_says_no_longer_that_it_is_recorded(tmp_path: Path) -> None:
    disc = Disc(free_bytes=600_000_000)
    bench, recorder = recorded(tmp_path, disc)
    maker = bench.controller._maker
    maker = replace(maker, specification=replace(maker.specification, is_recording=True))
    assert maker.make().is_recording
    disc.go_on(2.0, 150_000_000)
    bench.frames(1)
    assert not maker.make().is_recording
    recorder.close()

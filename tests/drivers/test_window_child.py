"""What the window's process decides, with a window that only notes what it is told."""

import os
import time
from collections.abc import Callable, Iterator

import pytest

from drivers.window_child import Keeper
from drivers.window_memory import HANG_LIMIT_NS, Field, WindowMemory, count_memory_bytes

S = 10**9


class Notes:
    """A window. `on_draw` happens while a picture is copied, `script` a step a round."""

    def __init__(self) -> None:
        self.drawn: bytes | None = None
        self.seen: list[bytes | None] = []
        self.on_draw: Callable[[], None] = lambda: None
        self.script: list[Callable[[], None]] = []
        self.place = True

    def draw(self, pixels: memoryview | None) -> None:
        self.drawn = None if pixels is None else bytes(pixels)
        self.on_draw()

    def flip(self) -> None:
        self.seen.append(self.drawn)

    def was_disturbed(self) -> bool:
        if self.script:
            self.script.pop(0)()
        return False

    def is_in_place(self) -> bool:
        return self.place


class Rig:
    """Both ends in one process."""

    def __init__(self) -> None:
        descriptor = os.memfd_create("test")
        os.ftruncate(descriptor, count_memory_bytes(1, 1))
        self.memory = WindowMemory(descriptor, 1, 1)
        os.close(descriptor)
        self.woken, self.wake = os.pipe()
        self.window = Notes()
        self.keeper = Keeper(self.window, self.memory, self.woken)  # type: ignore[arg-type]
        self.memory.fields[Field.APPLICATION_BEAT_NS] = time.monotonic_ns()

    def publish(self, pixels: bytes, for_ns: int = 60 * S) -> None:
        fields = self.memory.fields
        number = fields[Field.PUBLISHED] + 1
        fields[Field.WRITING] = number
        self.memory.pictures[number % 2][:] = pixels
        fields[Field.VALID_UNTIL_NS + number % 2] = time.monotonic_ns() + for_ns
        fields[Field.PUBLISHED] = number

    def run(self, *script: Callable[[], None]) -> list[bytes | None]:
        """What is seen while these things happen, one a round, then the end."""
        self.window.script = [*script, self.quit]
        self.keeper.run()
        return self.window.seen

    def quit(self) -> None:
        self.memory.fields[Field.QUIT] = 1


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.memory.close()
    for descriptor in (made.woken, made.wake):
        os.close(descriptor)


def test_a_picture_is_shown_once_and_replaced(rig) -> None:
    def nothing() -> None:
        pass

    seen = rig.run(lambda: rig.publish(b"aaaa"), nothing, lambda: rig.publish(b"bbbb"))
    assert seen == [b"aaaa", b"bbbb"]
    assert rig.memory.fields[Field.SEEN] == 2


def test_a_picture_that_is_overwritten_while_it_is_copied_is_not_shown(rig) -> None:
    def overtake() -> None:
        rig.window.on_draw = lambda: None
        rig.publish(b"bbbb")
        rig.publish(b"cccc")

    rig.window.on_draw = overtake
    assert rig.run(lambda: rig.publish(b"aaaa"), lambda: None) == [b"cccc"]


def test_a_picture_that_expires_while_it_is_copied_is_not_shown(rig) -> None:
    rig.window.on_draw = lambda: time.sleep(0.02)
    assert rig.run(lambda: rig.publish(b"aaaa", S // 100), lambda: None) == []


def test_a_withdrawn_picture_is_black_and_the_next_one_is_shown(rig) -> None:
    def withdraw() -> None:
        rig.memory.fields[Field.WITHDRAWN] = rig.memory.fields[Field.WRITING]

    seen = rig.run(
        lambda: rig.publish(b"aaaa"), withdraw, lambda: None, lambda: rig.publish(b"bbbb")
    )
    assert seen == [b"aaaa", None, b"bbbb"]


def test_the_picture_of_an_application_that_hung_stays_dark(rig) -> None:
    def hang() -> None:
        rig.memory.fields[Field.APPLICATION_BEAT_NS] -= HANG_LIMIT_NS + 1

    def wake_up() -> None:
        rig.memory.fields[Field.APPLICATION_BEAT_NS] = time.monotonic_ns()

    seen = rig.run(
        lambda: rig.publish(b"aaaa"), hang, wake_up, lambda: None, lambda: rig.publish(b"bbbb")
    )
    assert seen == [b"aaaa", None, b"bbbb"]


def test_it_ends_when_the_application_is_gone_or_the_window_out_of_place(rig) -> None:
    rig.window.place = False
    rig.keeper.run()
    rig.window.place = True
    rig.keeper._parent = -1
    rig.keeper.run()


def test_it_ends_with_the_pipe() -> None:
    rig = Rig()
    os.close(rig.wake)
    rig.keeper.run()
    assert rig.window.seen == []
    rig.memory.close()
    os.close(rig.woken)

import base64
import re
import zlib
from pathlib import Path

import numpy as np
import pytest

from navapp.ui.pictures.kitty import KittyEncoder, ask_whether_drawn

PICTURE = np.random.default_rng(1).integers(0, 32, (40, 60, 3), dtype=np.uint8) * np.uint8(8)


def commands(text: str) -> list[tuple[dict[str, str], str]]:
    """Keys and payload of every command."""
    found = re.findall(r"\x1b_G([^;]*);([^\x1b]*)\x1b\\", text)
    assert "".join(f"\x1b_G{keys};{payload}\x1b\\" for keys, payload in found) == text
    return [(dict(key.split("=") for key in keys.split(",")), payload) for keys, payload in found]


def test_shared_memory_holds_the_pixels_until_the_terminal_has_read_them() -> None:
    encoder = KittyEncoder(is_local=True)
    assert not encoder.is_busy
    ((keys, payload),) = commands(encoder.encode(7, PICTURE, 20, 10))
    assert (keys["a"], keys["t"], keys["f"], keys["i"]) == ("T", "s", "24", "7")
    assert (keys["s"], keys["v"], keys["c"], keys["r"]) == ("60", "40", "20", "10")
    path = Path("/dev/shm") / base64.standard_b64decode(payload).decode().lstrip("/")
    pixels = np.frombuffer(path.read_bytes(), np.uint8).reshape(40, 60, 3)
    np.testing.assert_array_equal(pixels, PICTURE[:, :, ::-1])
    assert encoder.is_busy
    path.unlink()
    assert not encoder.is_busy


def test_what_no_terminal_has_read_is_removed() -> None:
    encoder = KittyEncoder(is_local=True)
    before = set(Path("/dev/shm").iterdir())
    encoder.encode(1, PICTURE, 20, 10)
    encoder.encode(1, PICTURE, 20, 10)
    assert len(set(Path("/dev/shm").iterdir()) - before) == 2
    encoder.close()
    assert not set(Path("/dev/shm").iterdir()) - before


def test_compressed_pixels_come_in_pieces_that_the_protocol_allows() -> None:
    sent = commands(KittyEncoder(is_local=False).encode(3, PICTURE, 20, 10))
    assert len(sent) > 1
    assert all(len(payload) <= 4096 for _, payload in sent)
    assert [keys["m"] for keys, _ in sent] == ["1"] * (len(sent) - 1) + ["0"]
    assert (sent[0][0]["t"], sent[0][0]["o"]) == ("d", "z")
    data = zlib.decompress(base64.standard_b64decode("".join(payload for _, payload in sent)))
    pixels = np.frombuffer(data, np.uint8).reshape(40, 60, 3)
    np.testing.assert_array_equal(pixels, PICTURE[:, :, ::-1])


@pytest.mark.parametrize("is_local", [True, False])
def test_erasing_names_the_picture_alone(is_local: bool) -> None:
    ((keys, _),) = commands(KittyEncoder(is_local=is_local).erase(9))
    assert keys == {"a": "d", "d": "I", "i": "9", "q": "2"}


def test_the_question_leaves_nothing_behind() -> None:
    before = set(Path("/dev/shm").iterdir())
    with ask_whether_drawn(31, 32) as question:
        asked = commands(question.text)
        assert question.path.stat().st_mode & 0o777 == 0o600
        assert not question.was_read
        assert {keys["i"]: keys["t"] for keys, _ in asked} == {"32": "d", "31": "s"}
        assert len(set(Path("/dev/shm").iterdir()) - before) == 1
    assert not set(Path("/dev/shm").iterdir()) - before

"""Queries a video device for its formats by V4L2 calls that disturb no stream.

Numbers and layouts are those of the kernel's `linux/videodev2.h`.
"""

import errno
import fcntl
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Request number and layout of each question's structure.
_QUERYCAP = 0x80685600, struct.Struct("=16s32s32sIII12x")
_ENUM_FMT = 0xC0405602, struct.Struct("=III32sI16x")
_ENUM_FRAMESIZES = 0xC02C564A, struct.Struct("=III6I8x")
_ENUM_FRAMEINTERVALS = 0xC034564B, struct.Struct("=IIIII6I8x")

_VIDEO_CAPTURE, _DEVICE_CAPS = 0x1, 0x80000000
_CAPTURE_BUFFERS = 1
_DISCRETE = 1
# A damaged driver that never says "no more" must not keep us.
_MOST_ANSWERS = 256


@dataclass(frozen=True, slots=True)
class PictureSize:
    """Width and height, px, with the rates, Hz, at which it comes."""

    width: int
    height: int
    rates_hz: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PixelFormat:
    """A pixel format and its sizes."""

    fourcc: str  # as `[camera.opencv] fourcc` takes it
    description: str  # the driver's words
    # the camera's; of one that takes any size between two, these two.
    sizes: tuple[PictureSize, ...]


@dataclass(frozen=True, slots=True)
class VideoDevice:
    """What a video device says of itself."""

    card: str  # its name for people
    is_camera: bool  # it gives pictures; a camera's second device does not
    formats: tuple[PixelFormat, ...]  # in the driver's order


def ask(node: Path) -> VideoDevice:
    """Open a device, ask and close it: nothing is set and nothing streams.

    Raises:
        OSError: it cannot be opened, or is no video device.
    """
    descriptor = os.open(node, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _, card, _, _, all_abilities, own_abilities = _answer(descriptor, _QUERYCAP)
        # Of a camera with several devices the first number is about all, the second about this one.
        abilities = own_abilities if all_abilities & _DEVICE_CAPS else all_abilities
        is_camera = bool(abilities & _VIDEO_CAPTURE)
        formats = tuple(_formats(descriptor)) if is_camera else ()
        return VideoDevice(_text(card), is_camera, formats)
    finally:
        os.close(descriptor)


def _formats(descriptor: int) -> Iterator[PixelFormat]:
    for _, _, _, description, fourcc in _answers(
        descriptor, _ENUM_FMT, _CAPTURE_BUFFERS, 0, b"", 0
    ):
        name = fourcc.to_bytes(4, "little").decode("ascii", errors="replace").strip()
        yield PixelFormat(name, _text(description), tuple(_sizes(descriptor, fourcc)))


def _sizes(descriptor: int, fourcc: int) -> Iterator[PictureSize]:
    for _, _, kind, *numbers in _answers(descriptor, _ENUM_FRAMESIZES, fourcc, *[0] * 7):
        least_width, most_width, _, least_height, most_height, _ = numbers
        ends = [(least_width, least_height), (most_width, most_height)]
        for width, height in [(numbers[0], numbers[1])] if kind == _DISCRETE else ends:
            rates = tuple(_rates_hz(descriptor, fourcc, width, height))
            yield PictureSize(width, height, rates)


def _rates_hz(descriptor: int, fourcc: int, width: int, height: int) -> Iterator[float]:
    wanted = (fourcc, width, height, *[0] * 7)
    for _, _, _, _, kind, *numbers in _answers(descriptor, _ENUM_FRAMEINTERVALS, *wanted):
        # Frame periods as numerator and denominator, s: one, or the shortest and the longest.
        for k in (0,) if kind == _DISCRETE else (0, 2):
            if numbers[k]:
                yield round(numbers[k + 1] / numbers[k], 3)


def _answers(
    descriptor: int, question: tuple[int, struct.Struct], *rest: int | bytes
) -> Iterator[Any]:
    """The answers for the indices 0, 1, ... until there are no more."""
    for index in range(_MOST_ANSWERS):
        try:
            yield _answer(descriptor, question, index, *rest)
        except OSError as error:
            # A driver without this question says ENOTTY.
            if error.errno in (errno.EINVAL, errno.ENOTTY):
                return
            raise


def _answer(descriptor: int, question: tuple[int, struct.Struct], *fields: int | bytes) -> Any:
    request, layout = question
    data = bytearray(layout.pack(*fields) if fields else layout.size)
    fcntl.ioctl(descriptor, request, data)
    return layout.unpack(data)


def _text(padded: bytes) -> str:
    return padded.partition(b"\0")[0].decode(errors="replace").strip()

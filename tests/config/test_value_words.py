"""What the commented file says of a key's values is what reading it accepts."""

import re
import tomllib
from typing import Any

import pytest

from navapp.config import Configuration, format_toml, parse
from navapp.control.stages import STAGES
from navapp.errors import ConfigurationError

TEXT = format_toml(Configuration(), True)
# What a value asks for beside itself.
COMPANIONS: dict[tuple[str, str], dict[str, Any]] = {
    ("display.backend", "window"): {"size_px": [1920, 1080]},
    ("projector.backend", "pjlink"): {"host": "192.168.0.7"},
    ("projector.backend", "escvp21"): {"port": "/dev/ttyS0"},
    ("mirror.backend", "zaber"): {"port": "/dev/ttyS0"},
}


def find_explained() -> dict[str, str]:
    """Key with its table's name -> what the file says of its values."""
    table, words, found = "", "", {}
    for line in TEXT.splitlines():
        if line.startswith("["):
            table = line.strip("[]")
        elif line.startswith("# values: "):
            words = line.removeprefix("# values: ")
        elif line.startswith("#   "):
            words += line.removeprefix("#  ")
        elif key := re.match(r"(?:# )?(\w+) =", line):
            found[f"{table}.{key[1]}"], words = words, ""
    return found


EXPLAINED = find_explained()
CHOICES = {
    key: re.findall(r'"(\w+)"', words.partition("; default:")[0])
    for key, words in EXPLAINED.items()
    if words.startswith("one of ")
}
RANGES = {
    key: (float(found[1]), float(found[2]))
    for key, words in EXPLAINED.items()
    if (found := re.search(r"number from ([\d.]+) to ([\d.]+)", words))
}


def read(key: str, value: Any) -> Configuration:
    *tables, name = key.split(".")
    content: dict[str, Any] = {name: value, **COMPANIONS.get((key, value), {})}
    for table in reversed(tables):
        content = {table: content}
    return parse(content, "x")


def test_every_key_says_what_it_may_hold_and_its_default():
    assert len(EXPLAINED) > 70
    assert all("; default: " in words for words in EXPLAINED.values())
    assert all(len(line) <= 100 for line in TEXT.splitlines())
    assert parse(tomllib.loads(TEXT), "x") == Configuration()


def test_enough_keys_are_choices_and_ranges():
    assert {"display.backend", "tracking.method", "ui.pictures"} <= set(CHOICES)
    assert {"camera.depthai.iso", "mirror.device"} <= set(RANGES)


@pytest.mark.parametrize(("key", "value"), [(k, v) for k, found in CHOICES.items() for v in found])
def test_a_value_that_is_named_is_accepted(key, value):
    found: Any = read(key, value)
    for part in key.split("."):
        found = getattr(found, part)
    assert found == value


@pytest.mark.parametrize("key", CHOICES)
def test_another_value_is_refused(key):
    with pytest.raises(ConfigurationError, match=re.escape(key)):
        read(key, "nonsense")


@pytest.mark.parametrize("key", RANGES)
def test_a_range_is_what_is_accepted(key):
    kind = int if "whole" in EXPLAINED[key] else float
    low, high = (kind(limit) for limit in RANGES[key])
    read(key, low)
    read(key, high)
    for value in (kind(low - 1), kind(high + 1)):
        with pytest.raises(ConfigurationError, match=re.escape(key)):
            read(key, value)


def test_units_and_bounds_stand_beside_a_number():
    assert EXPLAINED["camera.rate_hz"].startswith("number above 0, in Hz")
    assert EXPLAINED["display.delay_ms"].startswith("number of at least 0, in ms")
    assert EXPLAINED["projector.tcp_port"].startswith("whole number above 0 and below 65536")
    assert EXPLAINED["camera.simulated.drift_mm_s"].startswith("number from 0 to 300, in mm/s;")


def test_the_keys_of_a_scripted_fault_are_told():
    words = EXPLAINED["camera.simulated.faults"]
    for key in ("kind", "start_s", "duration_s", "delay_s", "turn_deg"):
        assert f"{key} (" in words
    assert '"unplug"' in words


def test_the_stages_are_those_that_there_are():
    place = TEXT.index("first = ")
    words = TEXT[TEXT.rindex("# Where a session starts", 0, place) : place]
    assert all(stage.name in words for stage in STAGES)

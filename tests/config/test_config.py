import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from navapp.config import FILE_NAME, Configuration, find_file, format_toml, load, parse
from navapp.errors import ConfigurationError
from sim_devices.faults import FaultKind

# A value other than the default for every key that there is.
CHANGED: dict[str, Any] = {
    "camera": {
        "backend": "oak",
        "rig": "rigs/a b.yml",
        "rate_hz": 30.0,
        "depth_mm": [250.0, 900.5],
        "simulated": {
            "seed": 7,
            "side": "left",
            "sex": "male",
            "age_group": "old",
            "cartilage_mm": 1.25,
            "motion": "jump",
            "instrument": "sweep",
            "tool": "drill",
            "contrast": 0.03,
            "blood": 0.5,
            "highlights": 4.0,
            "covered": 0.4,
            "distance_mm": 500.0,
            "baseline_mm": 60.0,
            "light": 0.5,
            "full_well_e": 2000.0,
            "read_noise_e": 3.0,
            "defocus_px": 1.5,
            "misses": 0.25,
            "scale": 0.5,
            "stepped": True,
            "skew_ms": -3.5,
            "unstamped_skew_ms": 2.5,
            "grey": True,
            "blur": True,
            "shutter_ms": 15.0,
            "shake_mm": 0.3,
            "shake_hz": 5.0,
            "drift_mm_s": 60.0,
            "board_s": [0.0, 8.0],
            "faults": [
                {"kind": "freeze", "start_s": 1.5, "duration_s": float("inf")},
                {"kind": "delay", "start_s": 0, "duration_s": 2, "delay_s": 0.1},
            ],
        },
        "opencv": {
            "left": "A1",
            "right": "/dev/v4l/by-path/pci-0-video-index0",
            "fourcc": "YUYV",
            "width": 640,
            "height": 480,
            "exposure_ms": 4.5,
            "gain": 3.0,
            "white_balance_k": 5000.0,
            "focus": 0.0,
            "max_skew_ms": 2.0,
            "max_age_ms": 100.0,
        },
        "depthai": {
            "device": "14442C10D13EABCE00",
            "width": 640,
            "height": 400,
            "exposure_ms": 2.5,
            "iso": 400.0,
            "ir_dots": 0.5,
            "ir_flood": 0.25,
        },
    },
    "display": {
        "backend": "window",
        "output": 'DELL 24"',
        "size_px": [1920, 1080],
        "flip_horizontally": True,
        "flip_vertically": True,
        "valid_ms": 100.0,
        "delay_ms": 55.5,
        "delay_bound_ms": 2.5,
        "simulated": {"delay_ms": 12.0, "refresh_hz": 50.0},
    },
    "projector": {
        "backend": "escvp21",
        "host": "10.0.0.7",
        "tcp_port": 4353,
        "password_file": "pjlink.txt",
        "port": "/dev/ttyUSB0",
        "serial": "X4YZ",
    },
    "mirror": {
        "backend": "zaber",
        "calibrated_deg": 44.5,
        "eyes": "left",
        "check_minutes": 12.5,
        "port": "socket://stage:55550",
        "serial": "990123",
        "device": 2,
        "axis": 3,
    },
    "plan": {"path": 'plans\\p "1"', "prior": "prior.json"},
    "stereo": {},
    "registration": {},
    "tracking": {"method": "paper", "follow_refused": True},
    "tools": {"pointer": "tools/p.json", "drill": "tools/d.json"},
    "calibration": {
        "stop_capture_mm": 0.2,
        "accept_mm": 0.5,
        "working_depth_mm": [400.0, 500.0],
        "valid_days": 30,
        "board": "board.json",
    },
    "overlay": {},
    "stages": {"first": "3", "check_minutes": 12.5},
    "recording": {"folder": "sessions/1", "pictures": False},
    "link": {},
    "ui": {"pictures": "sixel"},
}


def keys_of(model: type[BaseModel], prefix: str = "") -> list[str]:
    found = []
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            found += keys_of(kind, f"{prefix}{name}.")
        else:
            found.append(prefix + name)
    return found


def value_at(content: Any, key: str) -> Any:
    for part in key.split("."):
        content = content[part] if isinstance(content, dict) else getattr(content, part)
    return content


KEYS = keys_of(Configuration)
# A display with a model is not flipped.
_MODEL = "display.model"
_FLIPS = {"flip_horizontally": False, "flip_vertically": False}
WITH_MODEL = {**CHANGED, "display": {**CHANGED["display"], **_FLIPS, "model": "display.yml"}}


def nested(key: str, value: Any) -> dict[str, Any]:
    for part in reversed(key.split(".")):
        value = {part: value}
    return value


@pytest.mark.parametrize("with_comments", [False, True])
def test_the_defaults_come_back(with_comments):
    text = format_toml(Configuration(), with_comments)
    assert parse(tomllib.loads(text), "x") == Configuration()
    assert parse({}, "x") == Configuration()


@pytest.mark.parametrize("with_comments", [False, True])
def test_every_key_of_every_section_comes_back(with_comments):
    for content, keys in ((CHANGED, set(KEYS) - {_MODEL}), (WITH_MODEL, {_MODEL})):
        configuration = parse(content, "x")
        for key in keys:
            assert value_at(configuration, key) != value_at(Configuration(), key), key
        again = parse(tomllib.loads(format_toml(configuration, with_comments)), "x")
        assert again == configuration


@pytest.mark.parametrize("flip", ["flip_horizontally", "flip_vertically"])
def test_a_display_with_a_model_is_not_flipped(flip: str) -> None:
    content = {**WITH_MODEL, "display": {**WITH_MODEL["display"], flip: True}}
    with pytest.raises(ConfigurationError, match="model knows its flips"):
        parse(content, "x")


def test_a_file_to_start_from_explains_every_key_and_section():
    text = format_toml(Configuration(), True)
    lines = text.splitlines()
    for name in Configuration.model_fields:
        assert f"[{name}]" in lines
    for key in KEYS:
        name = key.rsplit(".", 1)[-1]
        (place,) = (
            i
            for i, line in enumerate(lines)
            if line.lstrip("# ").startswith(f"{name} =")
            and section_of(lines, i) == key.rsplit(".", 1)[0]
        )
        assert lines[place - 1].startswith("# "), key
    assert "research software" in lines[0]


def section_of(lines: list[str], index: int) -> str:
    return next(line[1:-1] for line in reversed(lines[:index]) if line.startswith("["))


TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)


@settings(deadline=None)
@given(
    TEXT,
    st.floats(1e-300, 1e300),
    st.floats(-1e300, 1e300),
    st.dictionaries(TEXT, TEXT, max_size=3),
)
def test_any_text_and_number_comes_back(text, positive, number, table):
    content = {
        "camera": {
            "rig": text,
            "rate_hz": positive,
            "simulated": {"skew_ms": number},
            "oak-d": {"key": text, **table},
        }
    }
    configuration = parse(content, "x")
    assert parse(tomllib.loads(format_toml(configuration, True)), "x") == configuration


def test_tables_of_third_parties_pass_through():
    text = """
    [camera]
    backend = "zed"
    [camera.zed]
    gain = 3
    levels = [1, 2.5]
    made = 2024-05-06
    at = 2024-05-06T07:08:09Z
    limits = { low = 1, "high est" = true }
    "a key" = "x"
    [camera."my camera"]
    on = false
    """
    configuration = parse(tomllib.loads(text), "x")
    zed = configuration.camera.model_extra["zed"]
    assert zed["gain"] == 3
    assert zed["limits"] == {"low": 1, "high est": True}
    again = parse(tomllib.loads(format_toml(configuration, True)), "x")
    assert again == configuration
    assert again.camera.model_extra == configuration.camera.model_extra


@pytest.mark.parametrize("value", [1, "x", True, [1], [{"a": 1}]])
def test_other_keys_of_the_camera_must_be_tables(value):
    with pytest.raises(ConfigurationError, match=r"unknown key 'camera\.rate'.*rate_hz"):
        parse({"camera": {"rate": value}}, "x")


@pytest.mark.parametrize(
    ("content", "key", "nearest"),
    [
        ({"camra": {}}, "camra", "camera"),
        ({"display": {"valid_s": 1.0}}, "display.valid_s", "valid_ms"),
        ({"camera": {"simulated": {"sead": 1}}}, "camera.simulated.sead", "seed"),
        ({"tracking": {"metod": "icp"}}, "tracking.metod", "method"),
        ({"recording": {"picture": True}}, "recording.picture", "pictures"),
    ],
)
def test_an_unknown_key_names_the_nearest_known_one(content, key, nearest):
    with pytest.raises(ConfigurationError) as caught:
        parse(content, "my.toml")
    assert str(caught.value) == f"my.toml: unknown key '{key}': did you mean '{nearest}'?"
    assert caught.value.subject == key


def test_an_unknown_key_like_no_other_names_what_is_known():
    with pytest.raises(ConfigurationError, match=r"known here: backend, output, .*simulated$"):
        parse({"display": {"xyzzy": 1}}, "x")
    with pytest.raises(ConfigurationError, match=r"known here: nothing$"):
        parse({"link": {"xyzzy": 1}}, "x")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("camera", 5),
        ("camera.backend", 5),
        ("camera.rate_hz", "fast"),
        ("camera.rate_hz", True),
        ("camera.depth_mm", 300.0),
        ("camera.depth_mm", [300.0]),
        ("camera.depth_mm", [300.0, 400.0, 500.0]),
        ("camera.simulated", "yes"),
        ("camera.simulated.seed", 1.5),
        ("camera.simulated.side", "middle"),
        ("camera.simulated.grey", 1),
        ("camera.simulated.stepped", "no"),
        ("camera.simulated.faults", [3]),
        ("recording.pictures", "true"),
        ("tracking.method", "magic"),
        ("display.backend", "hdmi"),
        ("mirror.backend", "moving"),
        ("projector.backend", "serial"),
        ("stages.first", 1),
    ],
)
def test_a_wrong_type_names_the_key(key, value):
    with pytest.raises(ConfigurationError) as caught:
        parse(nested(key, value), "my.toml")
    assert caught.value.subject.startswith(key)
    assert str(caught.value).startswith(f"my.toml: {key}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("camera.rate_hz", 0.0),
        ("camera.rate_hz", -1.0),
        ("camera.rate_hz", float("inf")),
        ("camera.rate_hz", float("nan")),
        ("camera.depth_mm", [0.0, 300.0]),
        ("camera.depth_mm", [700.0, 300.0]),
        ("camera.depth_mm", [300.0, 300.0]),
        ("camera.simulated.cartilage_mm", -0.1),
        ("camera.simulated.cartilage_mm", 2.7),
        ("camera.simulated.seed", -1),
        ("camera.simulated.scale", 0.0),
        ("camera.simulated.scale", 1.01),
        ("camera.simulated.skew_ms", float("nan")),
        ("camera.simulated.shutter_ms", -1.0),
        ("camera.simulated.shake_hz", 0.0),
        ("camera.simulated.drift_mm_s", 301.0),
        ("display.valid_ms", 0.0),
        ("display.delay_ms", -1.0),
        ("display.simulated.refresh_hz", 0.0),
        ("display.size_px", [0, 720]),
        ("projector.tcp_port", 65536),
        ("mirror.calibrated_deg", float("inf")),
        ("mirror.device", 0),
        ("mirror.device", 100),
        ("mirror.axis", 0),
    ],
)
def test_a_value_out_of_bounds_names_the_key(key, value):
    with pytest.raises(ConfigurationError) as caught:
        parse(nested(key, value), "x")
    assert caught.value.subject.startswith(key)


@pytest.mark.parametrize(
    ("table", "backend", "text"),
    [
        ("display", "window", "a window needs size_px"),
        ("projector", "pjlink", "needs a host"),
        ("projector", "escvp21", "needs a port"),
        ("mirror", "zaber", "needs a port"),
    ],
)
def test_a_device_needs_to_be_described(table, backend, text):
    with pytest.raises(ConfigurationError, match=text):
        parse({table: {"backend": backend}}, "x")


def test_a_picture_is_valid_for_longer_than_it_is_late():
    display = parse({"display": {"valid_ms": 200.0, "delay_ms": 60.0}}, "x").display
    assert display.withdrawn_ms == 140.0
    with pytest.raises(ConfigurationError, match="delay_ms must be smaller than valid_ms"):
        parse({"display": {"valid_ms": 200.0, "delay_ms": 200.0}}, "x")


@pytest.mark.parametrize("key", ["camera.simulated.cartilage_mm", "camera.simulated.scale"])
def test_the_bounds_themselves_are_allowed(key):
    value = {"cartilage_mm": 2.6, "scale": 1.0}[key.rsplit(".", 1)[1]]
    assert value_at(parse(nested(key, value), "x"), key) == value


A_FAULT = {"kind": "drop", "start_s": 0.0, "duration_s": 1.0}


def test_every_fault_of_the_simulated_camera_can_be_scripted():
    for kind in FaultKind:
        turn = {"turn_deg": [0.02, 0.0, 0.0]} if kind is FaultKind.TURN else {}
        content = nested("camera.simulated.faults", [{**A_FAULT, "kind": kind.value, **turn}])
        assert parse(content, "x").camera.simulated.faults[0].kind == kind.value


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "melt"}, "faults.1.kind: input should be 'unplug'"),
        ({"start_s": -1.0}, "faults.1.start_s"),
        ({"start_s": True}, "faults.1.start_s"),
        ({"start_s": float("inf")}, "faults.1.start_s"),
        ({"duration_s": 0.0}, "faults.1.duration_s"),
        ({"duration_s": float("nan")}, "faults.1.duration_s"),
        ({"duration_s": "1"}, "faults.1.duration_s"),
        ({"delay_s": 0.1}, "faults.1: delay_s belongs to a delay, not to drop"),
        ({"kind": "delay", "delay_s": -0.1}, "faults.1.delay_s"),
        ({"kind": "turn"}, "turn_deg belongs to a turn, and a turn needs it"),
        ({"turn_deg": [0.0, 0.1, 0.0]}, "turn_deg belongs to a turn, and a turn needs it"),
        ({"strt_s": 1.0}, "faults.1.strt_s': did you mean 'start_s'?"),
    ],
)
def test_a_wrong_fault_is_refused_with_its_place(change, words):
    faults = [A_FAULT, {**A_FAULT, **change}]
    with pytest.raises(ConfigurationError) as caught:
        parse(nested("camera.simulated.faults", faults), "x")
    assert words in str(caught.value)


@pytest.mark.parametrize("key", list(A_FAULT))
def test_a_fault_needs_its_kind_and_times(key):
    fault = {name: value for name, value in A_FAULT.items() if name != key}
    with pytest.raises(ConfigurationError, match=rf"faults\.0\.{key}: field required"):
        parse(nested("camera.simulated.faults", [fault]), "x")


def test_whole_numbers_are_taken_for_lengths():
    assert parse({"camera": {"depth_mm": [200, 800]}}, "x").camera.depth_mm == (200.0, 800.0)


def test_a_configuration_cannot_be_changed():
    with pytest.raises(ValidationError, match="frozen"):
        Configuration().camera.backend = "replay"


@pytest.mark.parametrize("content", [b"[camera", b"x = ", b"[a]\n[a]\n", b"a = 1\na = 2\n"])
def test_broken_toml_is_refused_by_file_name(tmp_path, content):
    (tmp_path / "my.toml").write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"my\.toml is not valid TOML"):
        load(tmp_path / "my.toml")


def test_an_unreadable_file_is_refused_by_name(tmp_path):
    (tmp_path / "my.toml").write_bytes(b"\xff\xfe\x80")
    for path in (tmp_path / "my.toml", tmp_path / "none.toml", tmp_path):
        with pytest.raises(ConfigurationError, match="cannot be read") as caught:
            load(path)
        assert caught.value.subject == str(path)


def test_a_file_is_loaded(tmp_path):
    (tmp_path / "my.toml").write_text('[tracking]\nmethod = "icp"\n', encoding="utf-8")
    assert load(tmp_path / "my.toml").tracking.method == "icp"
    assert load(None) == Configuration()


def test_the_file_given_comes_first_then_the_folder_then_the_home(tmp_path, monkeypatch):
    here, home = tmp_path / "here", tmp_path / "home"
    here.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    assert find_file(None) is None

    users = home / ".config" / "navapp" / FILE_NAME
    users.parent.mkdir(parents=True)
    users.write_text("", encoding="utf-8")
    assert find_file(None) == users

    configured = tmp_path / "xdg" / "navapp" / FILE_NAME
    configured.parent.mkdir(parents=True)
    configured.write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    assert find_file(None) == configured

    (here / FILE_NAME).write_text("", encoding="utf-8")
    assert find_file(None) == Path(FILE_NAME)

    given_file = tmp_path / "given.toml"
    given_file.write_text("", encoding="utf-8")
    assert find_file(str(given_file)) == given_file


def test_a_given_file_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"none\.toml does not exist.*config init"):
        find_file(tmp_path / "none.toml")
    with pytest.raises(ConfigurationError, match="does not exist"):
        find_file(tmp_path)

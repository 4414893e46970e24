"""`navapp run --headless` on the simulated rig, and the replay of what it recorded."""

import itertools
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from navapp.cli.main import run
from navapp.config import SimulationSection
from navapp.devices.simulated_plan import make_built_in_plan
from navapp.devices.simulated_room import Pace, make_simulated_camera, scenario_of, simulation_of
from navapp.preop import write_plan
from navapp.values import Plan, StageContent
from sim_devices.anatomy import KneeSpec
from sim_devices.world import World
from tests.bones import femur_model

# Small pictures: the bone is found in them as well.
MOVING = """
[camera.simulated]
motion = "patient"
scale = 0.7
"""


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("settings") / "moving.toml"
    path.write_text(MOVING, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, moving: Path) -> Path:
    """A session of the scripted operator and its result, `a.json`; nobody writes into it."""
    folder = tmp_path_factory.mktemp("recorded")
    options = ["--quiet", "--config", str(moving), "run", "--headless", "--frames", "12"]
    files = ["--record", str(folder / "session"), "--json", str(folder / "a.json")]
    assert run([*options, *files]) == 0
    return folder


@pytest.fixture
def session(recorded: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(recorded / "session", tmp_path / "session"))


def result(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def events_of(session: Path) -> list[dict[str, Any]]:
    return list(map(json.loads, (session / "events.jsonl").read_text("utf-8").splitlines()))


@pytest.mark.slow
def test_the_scripted_operator_refuses_a_wrong_pose_then_accepts_and_tracks(recorded: Path) -> None:
    content = result(recorded / "a.json")
    frames = content["frames"]
    assert content["command"] == "run"
    assert content["units"] == {"length": "mm", "angle": "deg"}
    assert len(frames) == 12
    wrong = [f for f in frames if f["tre_mm"] is not None and f["tre_mm"] > 3.0]
    assert wrong, "the script must offer a wrong pose"
    assert all(f["status"] != "OK" and f["state"] == "review" for f in wrong)
    tracked = [f for f in frames if f["state"] == "navigating"]
    assert len(tracked) >= 4
    assert all(f["status"] == "OK" and f["tre_mm"] < 0.4 for f in tracked)
    assert content["summary"]["tre_mm"]["max"] < 0.4


@pytest.mark.slow
def test_a_recorded_session_replays_to_the_same_poses(tmp_path: Path, recorded: Path) -> None:
    second = tmp_path / "b.json"
    assert run(["--quiet", "replay", str(recorded / "session"), "--json", str(second)]) == 0
    for a, b in zip(result(recorded / "a.json")["frames"], result(second)["frames"], strict=True):
        assert a["camera_from_model"] == b["camera_from_model"]
        assert (a["state"], a["status"], a["reasons"]) == (b["state"], b["status"], b["reasons"])


KNEE = """
[camera.simulated]
motion = "patient"
seed = {seed}
"""
TWO_BONES = """
[[step]]
do = "register"
[[step]]
do = "stage"
stage = "opening"
at_frame = 4
[[step]]
do = "register"
[[step]]
do = "stage"
stage = "drilling"
at_frame = 9
[[step]]
do = "override"
stage = "drilling"
reason = "a test"
[[step]]
do = "blank"
at_frame = 12
"""


def plan_with_tibia_at_the_opening(seed: int) -> Plan:
    """A plan by which a stage that shows both bones unsawn follows the tibia."""
    settings = SimulationSection(seed=seed, motion="patient")
    world, pace = World(scenario_of(settings)), Pace.of(settings, is_headless=True)
    plan = make_built_in_plan(
        simulation_of(world, make_simulated_camera(world, settings, pace, 15.0))
    )
    targets = ("tibia/medial_plateau", "tibia/lateral_plateau")
    stages = {**plan.content.stages, "opening": StageContent("tibia", targets)}
    return replace(plan, content=replace(plan.content, stages=stages), digest="")


@pytest.mark.release
# Both bones of the first knee are found at once; those of the other one take a long search.
@pytest.mark.parametrize("seed", [5, 1])
def test_the_operators_script_has_two_bones_followed_at_once_and_they_replay_to_the_same_poses(
    tmp_path: Path, seed: int
) -> None:
    script, session, knee = (tmp_path / name for name in ("script.toml", "session", "knee.toml"))
    knee.write_text(KNEE.format(seed=seed), encoding="utf-8")
    write_plan(tmp_path / "plan", plan_with_tibia_at_the_opening(seed))
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    script.write_text(TWO_BONES, encoding="utf-8")
    options = ["--quiet", "--config", str(knee), "run", "--headless", "--frames", "17"]
    options += ["--plan", str(tmp_path / "plan"), "--stage", "drilling"]
    options += ["--operator", str(script), "--record", str(session)]
    assert run([*options, "--json", str(first)]) == 0
    frames = result(first)["frames"]
    blanks = [e for e in events_of(session) if e.get("command") == "blank"]
    assert [entry["sequence"] for entry in blanks] == [12]
    stages = [frame["stage"] for frame in frames]
    assert list(dict.fromkeys(stages)) == ["drilling", "opening"]
    assert stages[-1] == "drilling"
    for bone, other in (("tibia", "femur"), ("femur", "tibia")):
        its_turns = [f for f in frames if f["bone"] == bone and f["bodies"]]
        assert len(its_turns) >= 2
        assert all(set(frame["bodies"]) == {other} for frame in its_turns)
        assert all(b["index"] - a["index"] == 2 for a, b in itertools.pairwise(its_turns))
        said = [frame["bodies"][other] for frame in its_turns]
        # The drill hides the tibia.
        expected = "OK" if other == "femur" else "LOST"
        assert all(one["status"] == expected for one in said)
        assert all(one["tre_mm"] < 0.4 for one in said if expected == "OK")
    # The femur's stage goes on from where the femur is by then, without being looked for.
    back = frames[[f["bone"] for f in frames].index("tibia") :]
    assert next(f for f in back if f["bone"] == "femur")["state"] == "navigating"
    assert run(["--quiet", "replay", str(session), "--json", str(second)]) == 0
    for a, b in zip(frames, result(second)["frames"], strict=True):
        assert a["camera_from_model"] == b["camera_from_model"]
        assert set(a["bodies"]) == set(b["bodies"])
        for name, body in a["bodies"].items():
            for key in ("status", "reasons", "camera_from_model", "covariance"):
                assert body[key] == b["bodies"][name][key]


CUTS = """
[[step]]
do = "register"
[[step]]
do = "made"
name = "femur_distal"
[[step]]
do = "unmade"
name = "femur_distal"
at_frame = 7
[[step]]
do = "made"
name = "femur_distal"
"""


@pytest.mark.release
def test_a_session_with_cuts_replays_and_keeps_them_whatever_is_changed(
    tmp_path: Path, moving: Path
) -> None:
    script, session, out = (tmp_path / name for name in ("script.toml", "session", "b.json"))
    script.write_text(CUTS, encoding="utf-8")
    first = tmp_path / "a.json"
    options = ["--quiet", "--config", str(moving), "run", "--headless", "--frames", "11"]
    options += ["--operator", str(script)]
    assert run([*options, "--record", str(session), "--json", str(first)]) == 0
    frames = result(first)["frames"]
    versions = [frame["bone_version"] for frame in frames]
    assert [version for version, _ in itertools.groupby(versions)] == [0, 1, 0, 1]
    lines = (session / "poses.jsonl").read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["bone_version"] for line in lines] == versions
    assert run(["--quiet", "replay", str(session), "--json", str(out)]) == 0
    for a, b in zip(frames, result(out)["frames"], strict=True):
        for key in ("camera_from_model", "covariance", "bone_version", "measured"):
            assert a[key] == b[key]
    # Another operator registers, but the bone is cut where it was.
    given = ["--quiet", "replay", str(session), "--start", "5", "--json", str(out)]
    run(given)
    changed = [frame["bone_version"] for frame in result(out)["frames"]]
    assert changed == versions[5:]


@pytest.mark.slow
@pytest.mark.release
def test_the_tibia_is_found_from_the_accepted_femur_and_a_replay_finds_it_in_the_same_frame(
    tmp_path: Path,
) -> None:
    session, knee = tmp_path / "session", tmp_path / "knee.toml"
    knee.write_text('[camera.simulated]\nseed = 1305\nside = "left"\n', encoding="utf-8")
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    options = ["--quiet", "--config", str(knee), "run", "--headless", "--frames", "16"]
    options += ["--also", "tibia", "--record", str(session), "--json", str(first)]
    assert run(options) == 0
    frames = result(first)["frames"]
    turns = [frame for frame in frames if frame["bodies"]]
    assert len(turns) >= 3
    assert all(frame["state"] == "navigating" for frame in turns)
    assert all(frame["bodies"]["tibia"]["status"] == "OK" for frame in turns)
    assert all(frame["bodies"]["tibia"]["tre_mm"] < 0.4 for frame in turns)
    # Angles and gaps are of pairs in which both are OK, and of no other.
    assert [("limb" in frame) for frame in frames] == [bool(frame["bodies"]) for frame in frames]
    limb = turns[0]["limb"]
    assert 80.0 < limb["flexion_deg"] < 88.0
    assert result(first)["summary"]["limb"]["at_90_deg"] is not None
    taken = [event for event in events_of(session) if event["type"] == "other_take_over"]
    assert len(taken) == 1
    assert run(["--quiet", "replay", str(session), "--json", str(second)]) == 0
    for a, b in zip(frames, result(second)["frames"], strict=True):
        assert set(a["bodies"]) == set(b["bodies"])
        assert a.get("limb") == b.get("limb")
        for name, body in a["bodies"].items():
            for key in ("status", "reasons", "camera_from_model", "covariance"):
                assert body[key] == b["bodies"][name][key]


@pytest.fixture(scope="module")
def boxed(tmp_path_factory: pytest.TempPathFactory, moving: Path) -> Path:
    """A session in which somebody draws a box, and its result, `a.json`; nobody writes into it."""
    folder = tmp_path_factory.mktemp("boxed")
    script = folder / "script.toml"
    # Around what is seen of the femur, as a hand would draw it.
    script.write_text('[[step]]\ndo = "register"\nbox = [385, 115, 180, 175]\n', encoding="utf-8")
    options = ["--quiet", "--config", str(moving), "run", "--headless", "--frames", "4"]
    files = ["--record", str(folder / "session"), "--json", str(folder / "a.json")]
    assert run([*options, "--operator", str(script), *files]) == 0
    return folder


@pytest.mark.release
@pytest.mark.slow
def test_a_drawn_box_is_all_that_a_registration_needs(boxed: Path) -> None:
    frames = result(boxed / "a.json")["frames"]
    tracked = [frame for frame in frames if frame["state"] == "navigating"]
    assert tracked
    assert all(frame["tre_mm"] < 0.4 for frame in tracked)
    registers = [e for e in events_of(boxed / "session") if e.get("command") == "register"]
    assert [event["start"] for event in registers] == [{"box": [385, 115, 180, 175]}]


@pytest.mark.slow
@pytest.mark.release
def test_a_drawn_box_is_replayed(boxed: Path, tmp_path: Path) -> None:
    session, out = Path(shutil.copytree(boxed / "session", tmp_path / "session")), tmp_path / "b"
    assert run(["--quiet", "replay", str(session), "--json", str(out)]) == 0
    for a, b in zip(result(boxed / "a.json")["frames"], result(out)["frames"], strict=True):
        assert a["camera_from_model"] == b["camera_from_model"]
    # Whatever is changed, the bone is looked for where it was drawn: the prior knows nothing.
    (session / "prior.json").write_text("{}", encoding="utf-8")
    given = ["--quiet", "replay", str(session), "--start", "2", "--json", str(out)]
    # In pictures as small as these the bound may be too large for an OK.
    assert run(given) in (0, 4)
    assert result(out)["frames"][0]["camera_from_model"] is not None


def test_a_session_is_never_recorded_over_another(
    session: Path, moving: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in session.rglob("*") if path.is_file()}
    options = ["--quiet", "--config", str(moving), "run", "--headless", "--frames", "2"]
    assert run([*options, "--record", str(session)]) == 3
    assert str(session) in capsys.readouterr().err
    assert {path: path.read_bytes() for path in session.rglob("*") if path.is_file()} == before


def test_a_session_recorded_with_an_unknown_method_is_refused(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = session / "session.json"
    path.write_text(path.read_text(encoding="utf-8").replace("bimcc", "magic"), encoding="utf-8")
    assert run(["--quiet", "replay", str(session)]) == 3
    assert "unknown method 'magic'" in capsys.readouterr().err


def test_the_command_lines_words_go_before_the_recorded_sessions(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "other.yml"
    assert run(["--quiet", "replay", str(session), "--rig", str(missing)]) == 3
    assert str(missing) in capsys.readouterr().err
    # What is replaced is not even looked at.
    (session / "prior.json").write_text("{", encoding="utf-8")
    prior = tmp_path / "prior.json"
    prior.write_text("{}", encoding="utf-8")
    assert run(["--quiet", "replay", str(session), "--prior", str(prior)]) == 3
    assert str(session / "prior.json") not in capsys.readouterr().err
    assert run(["--quiet", "replay", str(session)]) == 3
    assert str(session / "prior.json") in capsys.readouterr().err


def test_verbose_tells_every_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = [*boarded(tmp_path, "scale = 0.25"), "--frames", "3"]
    for words, told in ((["--verbose"], ["0", "1", "2"]), ([], [])):
        run([*words, *(word for word in options if word != "--quiet")])
        lines = capsys.readouterr().err.splitlines()
        assert [line.split()[2] for line in lines if line.startswith("navapp: frame")] == told


def test_nothing_found_is_exit_code_4(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Another person's knee in the plan: the judge must not call anything OK.
    other = tmp_path / "other.toml"
    other.write_text("[camera.simulated]\nseed = 1\n", encoding="utf-8")
    plan = make_foreign_plan(tmp_path)
    options = ["--quiet", "--config", str(other), "run", "--headless", "--frames", "1"]
    assert run([*options, "--plan", str(plan)]) == 4
    assert "no frame was OK" in capsys.readouterr().err


def make_foreign_plan(folder: Path) -> Path:
    bone = femur_model(KneeSpec(seed=7, side="left", sex="male"))
    write_plan(folder / "foreign", Plan({"femur": bone}))
    return folder / "foreign"


@pytest.mark.release
@pytest.mark.slow
def test_a_recording_with_dropped_frames_replays_to_the_same_poses(
    tmp_path: Path, recorded: Path, session: Path
) -> None:
    """A live session numbers its frames with gaps: what the line did not take is not recorded."""
    second = tmp_path / "b.json"
    renumber(session)
    assert run(["--quiet", "replay", str(session), "--json", str(second)]) == 0
    for a, b in zip(result(recorded / "a.json")["frames"], result(second)["frames"], strict=True):
        assert b["index"] == with_gaps(a["index"])
        assert a["state"] == b["state"]
        assert a["camera_from_model"] == b["camera_from_model"]


def with_gaps(number: int) -> int:
    """The number that a frame would have had, if the line had missed some before it."""
    return number if number < 2 else 3 * number + 7


def renumber(session: Path) -> None:
    """Make a session look as if frames had been dropped while it was recorded."""
    head, *rows = (session / "frames.csv").read_text(encoding="utf-8").splitlines()
    table = [head]
    for row in rows:
        number, *rest = row.split(",")
        table.append(",".join([str(with_gaps(int(number))), *rest]))
    (session / "frames.csv").write_text("\n".join(table) + "\n", encoding="utf-8")
    lines = []
    for line in (session / "events.jsonl").read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        # A take-over names the frame before which it happened, everything else the one after.
        offset = 1 if entry["type"] == "take_over" else 0
        entry["sequence"] = with_gaps(entry["sequence"] - offset) + offset
        lines.append(json.dumps(entry))
    (session / "events.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")


BOARDED = """
[camera]
rate_hz = 1.0
[camera.simulated]
motion = "still"
board_s = [0.0, 60.0]
{more}
[calibration]
board = "{board}"
"""
BOARD = {
    "type": "charuco", "squares_x": 9, "squares_y": 6, "square_mm": 12.0, "marker_mm": 9.0,
    "dictionary": "DICT_4X4_100",
}  # fmt: skip


def boarded(folder: Path, more: str = "") -> list[str]:
    """Options of a session that is shown a board for as long as it lasts; more of its camera."""
    (folder / "board.json").write_text(json.dumps(BOARD), encoding="utf-8")
    text = BOARDED.format(more=more, board=(folder / "board.json").as_posix())
    (folder / "boarded.toml").write_text(text, encoding="utf-8")
    (folder / "idle.toml").write_text('[[step]]\ndo = "show"\n', encoding="utf-8")
    options = ["--quiet", "--config", str(folder / "boarded.toml"), "run", "--headless"]
    return [*options, "--operator", str(folder / "idle.toml")]


@pytest.mark.release
@pytest.mark.slow
def test_a_board_in_view_checks_the_rig(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    run([*boarded(tmp_path), "--frames", "7", "--json", str(out)])
    rig = result(out)["rig"]
    assert rig["alarm"] is None
    check = rig["length_check"]
    assert check["finding"] == "within"
    assert check["looks"] >= 3
    assert check["length_100_mm"]["mean"] == pytest.approx(100.0, abs=0.02)
    assert 0.0 <= check["age_s"] <= 3.0


@pytest.mark.slow
@pytest.mark.release
def test_a_board_in_view_finds_a_camera_that_turned_sideways_and_so_does_the_replay(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Two thirds of a pixel.
    faults = (
        'faults = [{kind = "turn", start_s = 3.0, duration_s = inf, turn_deg = [0, 0.0246, 0]}]'
    )
    out, again, session = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "session"
    options = [*boarded(tmp_path, faults), "--frames", "18"]
    assert run([*options, "--record", str(session), "--json", str(out)]) == 3
    assert "rig moved, recalibrate (100 mm on the board" in capsys.readouterr().err
    content = result(out)
    assert content["rig"]["length_check"]["length_100_mm"]["mean"] == pytest.approx(
        100.24, abs=0.03
    )
    states = [frame["state"] for frame in content["frames"]]
    assert states[0] != "fault"
    assert states[-1] == "fault"
    assert run(["--quiet", "replay", str(session), "--json", str(again)]) == 3
    assert [frame["state"] for frame in result(again)["frames"]] == states
    after = states.index("fault") - 1
    changed = ["--method", "icp", "--start", str(after + 1)]
    assert run(["--quiet", "replay", str(session), *changed, "--json", str(again)]) == 3
    content = result(again)
    assert content["rig"]["moved_after_frame"] == after
    assert content["frames"]
    assert {frame["state"] for frame in content["frames"]} == {"fault"}
    assert {tuple(one["reasons"]) for one in content["frames"]} == {("rig moved, recalibrate",)}


def test_a_board_to_be_shown_must_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.toml"
    path.write_text("[camera.simulated]\nboard_s = [0.0, 1.0]\n", encoding="utf-8")
    assert run(["--quiet", "--config", str(path), "run", "--headless", "--frames", "1"]) == 2
    assert "[calibration] board" in capsys.readouterr().err
    options = boarded(tmp_path)
    (tmp_path / "board.json").write_text(json.dumps({**BOARD, "square_mm": 1.0, "marker_mm": 0.7}))
    assert run([*options, "--frames", "1"]) == 2
    assert "unit of length" in capsys.readouterr().err

"""`navapp calibrate mirror --by-keys`: the simulated room without a screen; what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration.targets.boards import read_board
from navapp.cli.main import _parser, run
from navapp.cli.mirror_by_keys import make_session
from navapp.config import parse
from navapp.control.mirror_alignment.alignment import MirrorAlignment
from navapp.control.mirror_alignment.kept_crosses import KeptCross
from navapp.devices.mirror_alignment import make_practice_eye, open_mirror_alignment
from navapp.devices.simulated_mirror import true_display
from navapp.geometry.display_model_files import read_display_model
from navapp.geometry.rig import RigQuality
from navapp.geometry.rig_files import write_rig
from sim_devices.rigs import make_default_rig
from tests.control.test_truth_stays_out import reachable
from tests.e2e.test_bad_input import refused
from tests.geometry.test_display_model_errors import seen_beside_mm
from tests.many import few_of

BOARD = {
    "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 20.0,
    "marker_mm": 14.0, "dictionary": "DICT_4X4_100",
}  # fmt: skip


@pytest.fixture
def board(tmp_path: Path) -> str:
    path = tmp_path / "board.json"
    path.write_text(json.dumps(BOARD))
    return str(path)


def calibrate(out: Path, *more: str, config: Path | None = None) -> int:
    options = ["calibrate", "mirror", "--out", str(out), *more]
    return run(["--quiet", *(["--config", str(config)] if config else []), *options])


def small_room(path: Path, seed: int, more: str = "") -> Path:
    """A configuration whose pictures are half as large."""
    path.write_text(f"[camera.simulated]\nscale = 0.5\nseed = {seed}\n{more}")
    return path


def true_errors_mm(out: Path, seed: int) -> np.ndarray:
    """Of what the written model draws at the anatomy, seen from the true eye; held-out points."""
    setup = make_practice_eye(seed).setup
    half_mm = np.array([30.0, 30.0, 25.0])
    points = setup.site_mm + np.random.default_rng(9).uniform(-1.0, 1.0, (200, 3)) * half_mm
    return seen_beside_mm(read_display_model(out), true_display(setup), points, points)


@pytest.mark.slow
@pytest.mark.parametrize("seed", few_of(range(8)))
def test_a_simulated_eye_calibrates_its_display(board: str, tmp_path: Path, seed: int) -> None:
    out, told = tmp_path / "display.yml", tmp_path / "told.json"
    config = small_room(tmp_path / "navapp.toml", seed)
    options = ["--board", board, "--by-keys", "--headless", "--viewing-eye", "left"]
    report = ["--json", str(told), "--report", str(tmp_path / "report.html")]
    assert calibrate(out, *options, *report, config=config) == 0
    assert np.quantile(true_errors_mm(out, seed), 0.95) <= 0.6
    model, true = read_display_model(out), true_display(make_practice_eye(seed).setup)
    assert (model.flips_columns, model.flips_rows) == (true.flips_columns, true.flips_rows)
    assert (model.viewing_eye, model.display_name) == ("left", "sim:display")
    assert "Accepted." in (tmp_path / "report.html").read_text(encoding="utf-8")
    # What was kept gives the same display again.
    again, told_again = tmp_path / "again.yml", tmp_path / "again.json"
    made = tmp_path / "display.alignments.json"
    assert calibrate(again, "--alignments", str(made), "--json", str(told_again)) == 0
    assert json.loads(told_again.read_text()) == json.loads(told.read_text())
    assert len(json.loads(made.read_text())["alignments"]) >= 12
    assert not list(tmp_path.glob("*.unfinished.json"))
    assert json.loads(told.read_text())["reads_upside_down_as_told"] is model.flips_rows
    assert "told; alignments cannot tell" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.release
def test_a_camera_that_is_lost_keeps_what_was_asked_for(board: str, tmp_path: Path, capsys) -> None:
    fault = 'faults = [{kind = "unplug", start_s = 2.0, duration_s = inf}]\n'
    config = small_room(tmp_path / "navapp.toml", 0, fault)
    few, out = tmp_path / "few.json", tmp_path / "display.yml"
    options = ["--board", board, "--by-keys", "--headless"]
    assert calibrate(out, *options, "--save-alignments", str(few), config=config) == 5
    assert "unplugged" in capsys.readouterr().err
    n_kept = len(json.loads(few.read_text())["alignments"])
    assert 1 <= n_kept < 12
    assert not out.exists()
    # Too few that nobody asked for replace no finished file.
    few.unlink()
    finished = tmp_path / "display.alignments.json"
    finished.write_text("of last week")
    assert calibrate(out, *options, config=config) == 5
    assert finished.read_text() == "of last week"
    unfinished = tmp_path / "display.alignments.unfinished.json"
    assert len(json.loads(unfinished.read_text())["alignments"]) == n_kept


def opened_session(board: str, *more: str):
    """A session in the simulated room, and what was opened for it."""
    parsed = ["calibrate", "mirror", "--by-keys", "--board", board, "--out", "d.yml", *more]
    options, configuration = _parser().parse_args(parsed), parse({}, "x")
    opened = open_mirror_alignment(configuration, read_board(board), is_headless=options.headless)
    return make_session(opened, read_board(board), options, configuration), opened


@pytest.mark.parametrize("more", few_of([(), ("--headless",)]), ids=["screen", "headless"])
def test_the_session_never_gets_hold_of_the_mirror_or_of_what_an_eye_aims_at(
    board: str, more: tuple[str, ...]
) -> None:
    session, opened = opened_session(board, *more)
    truth = {"MirrorSetup", "AligningEye", "PracticeEye"}
    try:
        # What the eye sees is pictures for the screen; nothing else asks for it.
        names = {type(one).__name__ for one in reachable(session, {id(opened.look)})}
        through = {type(one).__name__ for one in reachable(session, set())}
    finally:
        session.close()
        opened.close()
    assert "StereoRig" in names
    assert not names & truth
    # The walk does find them where they are, and without a screen nobody looks.
    assert truth <= {type(one).__name__ for one in reachable(opened, set())}
    assert bool(through & truth) is not bool(more)
    assert not hasattr(opened.look, "__self__")


def test_a_person_knows_the_plate_to_a_millimetre_and_the_display_to_a_tenth_of_an_inch(
    board: str,
) -> None:
    session, opened = opened_session(board, "--headless")
    session.close()
    opened.close()
    display, _ = session.made
    seed = parse({}, "x").camera.simulated.seed
    true_mm = make_practice_eye(seed).setup.plate.thickness_mm
    assert true_mm != round(true_mm)
    assert display.glass_mm == max(1, round(true_mm))
    inch = display.pitch_mm * np.hypot(display.width_px, display.height_px) / 25.4
    assert abs(inch * 10.0 - round(inch * 10.0)) < 1e-9


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A screen on which crosses are aligned until somebody presses ctrl+c."""
    from navapp.cli import mirror_by_keys

    def on_screen(session: MirrorAlignment) -> int:
        room = session._hand
        assert room is not None
        for k in range(14):
            point = np.array([30.0 * (k % 3), 25.0 * (k // 3 % 3), 430.0 + 20.0 * (k % 4)])
            session._kept.add(KeptCross(k, (900 + 9 * k, 500 + 7 * k), point, 0.1, point))
            session._write()
        return 130

    monkeypatch.setattr("navapp.ui.terminal.check_terminal", lambda: None)
    monkeypatch.setattr(mirror_by_keys, "_on_screen", on_screen)


@pytest.mark.usefixtures("interrupted")
def test_an_interruption_keeps_the_alignments_and_touches_no_display(
    board: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from calibration.mirror import alignments

    def solve(*_args: object) -> None:
        raise AssertionError("it is solved")

    monkeypatch.setattr(alignments, "solve_alignments", solve)
    out = tmp_path / "display.yml"
    out.write_text("of last week")
    config = small_room(tmp_path / "navapp.toml", 0)
    assert calibrate(out, "--board", board, "--by-keys", config=config) == 130
    assert out.read_text() == "of last week"
    made = json.loads((tmp_path / "display.alignments.json").read_text())
    assert len(made["alignments"]) == 14
    assert not list(tmp_path.glob("*.unfinished.json"))


@pytest.mark.release
@pytest.mark.slow
def test_json_on_the_standard_output_is_nothing_but_json(
    board: str, tmp_path: Path, capsys
) -> None:
    config = small_room(tmp_path / "navapp.toml", 0)
    words = ["calibrate", "mirror", "--out", str(tmp_path / "d.yml"), "--board", board]
    words += ["--by-keys", "--headless", "--json", "-"]
    assert run(["--config", str(config), *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["accepted"] is True


def test_a_screen_needs_a_terminal_before_any_device_is_opened(
    board: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    def opened(*_args: object, **_more: object) -> None:
        raise AssertionError("a device is opened")

    monkeypatch.setattr("navapp.devices.open_mirror_alignment", opened)
    assert calibrate(tmp_path / "d.yml", "--board", board, "--by-keys") == 2
    assert "needs a terminal" in capsys.readouterr().err
    assert not (tmp_path / "d.yml").exists()


def test_a_rig_that_was_not_accepted_calibrates_no_display(
    board: str, tmp_path: Path, capsys
) -> None:
    rig = tmp_path / "rig.yml"
    quality = RigQuality(is_accepted=False, reasons=("too few views",))
    write_rig(rig, replace(make_default_rig(), quality=quality))
    options = ["--board", board, "--by-keys", "--headless", "--rig", str(rig)]
    assert calibrate(tmp_path / "d.yml", *options) == 3
    assert "was not accepted by its calibration" in capsys.readouterr().err


BAD = {
    "no board": (["--by-keys"], "", "needs the board"),
    "two sources": (["--by-keys", "--alignments", "a.json"], "", "needs one source"),
    "a camera's eye": (
        ["--by-keys", "--board", "board.json", "--viewing-eye", "camera"], "",
        "--viewing-eye left or right",
    ),
    "a size": (["--by-keys", "--board", "board.json", "--size", "9x9"], "", "--size does not go"),
    "headless alone": (["--alignments", "a.json", "--headless"], "", "belongs to --by-keys"),
    **{
        f"{option} with {source[0]}": (
            [*source, option, *value], "", f"{option} does not go with {source[0]}",
        )
        for source, options in {
            ("--alignments", "a.json"): {
                "--viewing-eye": ["left"], "--glass-mm": ["0"], "--diagonal-inch": ["24"],
                "--curved": [], "--glass-deg": ["45"], "--board": ["b.json"], "--rig": ["r"],
            },
            ("--by-keys",): {"--curved": [], "--lens": ["l"], "--eye-views": ["1"]},
            ("--views", "v"): {"--upside-down": [], "--save-alignments": ["s.json"]},
            ("--pattern", "p.png"): {"--rig": ["r"], "--report": ["r.html"], "--force": []},
        }.items()
        for option, value in options.items()
    },
    "real, headless": (
        ["--by-keys", "--board", "board.json", "--headless"], '[camera]\nbackend = "uvc"\n',
        "simulated room",
    ),
    "no inches": (
        ["--by-keys", "--board", "board.json"], '[camera]\nbackend = "uvc"\n', "--diagonal-inch",
    ),
    "no length": (
        ["--by-keys", "--board", "board.json", "--diagonal-inch", "-3"], "", "must be a length",
    ),
    "half simulated": (
        ["--by-keys", "--board", "board.json", "--diagonal-inch", "24"],
        '[camera]\nbackend = "uvc"\n', "no eye sees the board",
    ),
    "another size": (
        ["--by-keys", "--board", "board.json"], "[display]\nsize_px = [640, 480]\n",
        "is 1920x1080",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_done_is_refused(
    what: str, board: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("navapp.ui.terminal.check_terminal", lambda: None)
    arguments, configured, words = BAD[what]
    config = tmp_path / "navapp.toml"
    config.write_text(configured)
    out = [] if "--pattern" in arguments else ["--out", "d.yml"]
    command = ["--config", str(config), "calibrate", "mirror", *out, *arguments]
    refused(command, capsys, 2, words)

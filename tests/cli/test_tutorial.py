"""The tutorial: what it asks, what it keeps, and that its own files navigate."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.cli import main, tutorial, tutorial_patient
from navapp.cli.diagnostics import Diagnostics
from navapp.cli.main import run
from navapp.cli.tutorial_folder import TutorialFolder
from navapp.cli.tutorial_patient import write_patient
from navapp.cli.tutorial_steps import STEPS, Step
from navapp.errors import DeviceError, InputError, UsageError
from navapp.preop.contents_file import read_contents
from navapp.preop.volume import read_ct
from navapp.ui.tutorial.guide import Guide
from navapp.values import BoneModel
from sim_devices.anatomy import make_knee


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A terminal in which somebody types these answers."""
    answers: list[str] = []

    def type_answer(_: str) -> str:
        if not answers:
            raise EOFError
        return answers.pop(0)

    monkeypatch.setattr("builtins.input", type_answer)
    monkeypatch.setattr(tutorial, "_has_terminal", lambda: True)
    return answers


def test_without_a_terminal_it_says_so_and_makes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["tutorial", "--out", str(tmp_path / "new")]) == 2
    assert "needs a terminal" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_there_are_four_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["tutorial", "--out", str(tmp_path / "new"), "--step", "5"]) == 2
    assert "--step 5 does not exist: give 1 to 4" in capsys.readouterr().err


def test_it_takes_no_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--config", "mine.toml", "tutorial", "--out", str(tmp_path / "new")]) == 2
    assert "devices of its own: leave --config away" in capsys.readouterr().err


@pytest.mark.usefixtures("terminal")
def test_a_folder_with_other_content_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.txt").write_text("years of work", encoding="utf-8")
    assert run(["tutorial", "--out", str(tmp_path)]) == 2
    assert "is no folder of a tutorial: name a new folder with --out" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_what_is_done_is_kept(tmp_path: Path) -> None:
    folder = TutorialFolder(tmp_path / "t")
    folder.begin()
    folder.mark_done(3)
    again = TutorialFolder(tmp_path / "t")
    again.begin()
    again.mark_done(1)
    assert again.read_done() == {1, 3}
    assert folder.find_capture().name == "capture"
    folder.find_capture().mkdir()
    assert folder.find_capture().name == "capture_2"


def test_a_beginning_that_was_interrupted_is_gone_on_with(tmp_path: Path) -> None:
    folder = TutorialFolder(tmp_path / "t")
    folder.begin()
    folder.board.unlink()
    folder.configuration.write_text("# mine\n", encoding="utf-8")
    folder.begin()
    assert folder.board.is_file()
    assert folder.configuration.read_text(encoding="utf-8") == "# mine\n"


def test_a_damaged_record_is_told(tmp_path: Path) -> None:
    folder = TutorialFolder(tmp_path)
    folder.begin()
    (tmp_path / "tutorial.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="begin in a new folder"):
        folder.read_done()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "t").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="no folder of a tutorial"):
        TutorialFolder(tmp_path / "t").begin()


def test_the_words_fit_into_eighty_columns() -> None:
    assert max(len(line) for step in STEPS for line in step.text.splitlines()) < 80


def with_steps(monkeypatch: pytest.MonkeyPatch, **answers: Any) -> list[int]:
    """Steps that answer at once, by number; in the list stands which were begun."""
    begun: list[int] = []

    def make(step: Step) -> Step:
        def do(_folder: TutorialFolder, _diagnostics: Diagnostics) -> bool:
            begun.append(step.number)
            answer = answers.get(f"step_{step.number}", True)
            if isinstance(answer, Exception):
                raise answer
            return bool(answer)

        return Step(step.number, step.title, step.text, step.needs, do)

    monkeypatch.setattr(tutorial, "STEPS", tuple(make(step) for step in STEPS))
    return begun


def told(tmp_path: Path) -> list[tuple[int, bool]]:
    content = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    return [(step["number"], step["done"]) for step in content["steps"]]


def lead(tmp_path: Path, *more: str) -> int:
    arguments = ["tutorial", "--out", str(tmp_path / "t"), "--json", str(tmp_path / "result.json")]
    return run([*arguments, *more])


def test_it_leads_through_all_steps(
    tmp_path: Path,
    terminal: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    begun = with_steps(monkeypatch)
    terminal += ["", "", "", ""]
    assert lead(tmp_path) == 0
    assert begun == [1, 2, 3, 4]
    assert told(tmp_path) == [(1, True), (2, True), (3, True), (4, True)]
    assert "That was the tutorial" in capsys.readouterr().out


def test_it_goes_on_where_it_was_left(
    tmp_path: Path, terminal: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = with_steps(monkeypatch)
    terminal += ["", "q"]
    assert lead(tmp_path) == 0
    terminal += ["what?", "", "q"]
    assert lead(tmp_path) == 0
    assert begun == [1, 2]
    assert told(tmp_path) == [(1, True), (2, True), (3, False), (4, False)]


def test_a_step_waits_for_what_others_make(
    tmp_path: Path,
    terminal: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    begun = with_steps(monkeypatch)
    terminal += ["", ""]
    assert lead(tmp_path, "--step", "4") == 0
    assert begun == []
    assert "it needs what step 2 and 3 makes" in capsys.readouterr().out


def test_a_step_that_fails_is_told_and_may_be_done_again(
    tmp_path: Path,
    terminal: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    begun = with_steps(monkeypatch, step_1=DeviceError("no camera"), step_2=False)
    terminal += ["", "", "s", "", "s", "q"]
    assert lead(tmp_path) == 0
    assert begun == [1, 1, 2]
    assert told(tmp_path) == [(1, False), (2, False), (3, False), (4, False)]
    assert "navapp: error: no camera" in capsys.readouterr().err


def complete(guide: Guide[Any]) -> None:
    guide._n_reached = guide.n_tasks


@pytest.mark.parametrize(
    ("number", "verbs"),
    [(1, ["run"]), (2, ["calibrate", "calibrate"]), (3, ["plan"]), (4, ["run"])],
)
def test_a_step_runs_its_verbs(
    number: int, verbs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = TutorialFolder(tmp_path / "t")
    folder.begin()
    folder.ct.write_bytes(b"is there")
    called: list[str] = []

    def call(arguments: list[str], _: Diagnostics, guide: Guide[Any] | None) -> int:
        options = main._parser().parse_args(arguments)
        assert options.config == str(folder.configuration)
        called.append(options.verb)
        if guide is not None:
            complete(guide)
        return 0

    monkeypatch.setattr(main, "call", call)
    assert STEPS[number - 1].run(folder, Diagnostics(is_quiet=True))
    assert called == verbs


def test_a_screen_that_is_left_early_is_no_step_that_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = TutorialFolder(tmp_path / "t")
    folder.begin()
    monkeypatch.setattr(main, "call", lambda *_, **__: 0)
    assert not STEPS[0].run(folder, Diagnostics())
    assert "left after 0 of 6 things to do" in capsys.readouterr().out


def test_the_patient_is_the_one_that_the_cameras_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tutorial_patient, "_VOXEL_MM", (2.0, 2.0, 2.0))
    folder = TutorialFolder(tmp_path)
    folder.begin()
    write_patient(folder)
    volume = read_ct(folder.ct).volume
    k, j, i = np.nonzero(volume.hu > 450.0)
    dense = volume.points_lps_mm(np.column_stack([i, j, k]))
    knee = make_knee()
    bones = np.vstack([mesh.vertices_mm for mesh in knee.bones.values()])
    assert np.abs(dense.min(axis=0) - bones.min(axis=0)).max() < 4.0
    assert np.abs(dense.max(axis=0) - bones.max(axis=0)).max() < 4.0
    femur = BoneModel("femur", knee.bones["femur"], "right")
    planned = read_contents(folder.contents, {"femur": femur})
    entry_mm = planned.content.drills["femoral_guide"].entry_mm
    distances = np.linalg.norm(femur.mesh.vertices_mm - entry_mm, axis=1)
    assert distances.min() < 1.5, "the hole is planned on the femur"
    assert {path.name for path in tmp_path.iterdir()} == {
        "board.json", "contents.toml", "ct.nii.gz", "navapp.toml", "tutorial.json",
    }  # fmt: skip


@pytest.mark.release
@pytest.mark.slow
@pytest.mark.timeout(900)
def test_its_own_rig_and_plan_navigate(tmp_path: Path) -> None:
    folder = TutorialFolder(tmp_path / "t")
    folder.begin()
    write_patient(folder)
    base = ["--quiet", "--config", str(folder.configuration)]
    pairs, board = str(folder.find_capture()), ["--board", str(folder.board)]
    assert run([*base, "calibrate", "capture", *board, "--out", pairs, "--headless"]) == 0
    assert run([*base, "calibrate", "stereo", pairs, *board, "--out", str(folder.rig)]) == 0
    source = ["--ct", str(folder.ct), "--contents", str(folder.contents), "--side", "right"]
    assert run([*base, "plan", *source, "--out", str(folder.plan)]) == 0
    made = ["--rig", str(folder.rig), "--plan", str(folder.plan)]
    result = tmp_path / "run.json"
    session = ["run", *made, "--headless", "--frames", "30", "--json", str(result)]
    assert run([*base, *session]) == 0
    told = json.loads(result.read_text(encoding="utf-8"))
    assert told["frames"][-1]["status"] == "OK"
    assert told["summary"]["ok"] >= 20
    assert told["summary"]["tre_mm"]["max"] < 0.5

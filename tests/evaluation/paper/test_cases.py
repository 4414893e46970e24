"""The cases of the paper's tables, and their seeds, that nothing else uses."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from navapp.control.stages import STAGES
from navapp.evaluation.paper.cases import (
    ALL_CASES,
    FIRST_ABLATION_SEED,
    FIRST_SEED,
    INSTRUMENT_S,
    MOST_TESTS,
    SAMPLES,
    SITUATIONS,
    STAGE_NAMES,
    list_tests,
)
from navapp.evaluation.stress.axes import AXES, FIRST_STRESS_SEED, MOST_KNEES
from sim_devices.motion import SWEEP_PERIOD_S
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.sim_devices.test_world import mask_of

ROOT = Path(__file__).parents[3]
SEEDS = range(FIRST_SEED, FIRST_SEED + len(ALL_CASES) * MOST_TESTS)
# Those of the stress matrix follow.
WITH_STRESS = range(FIRST_SEED, FIRST_STRESS_SEED + len(AXES) * MOST_KNEES)
ABLATION = range(FIRST_ABLATION_SEED, FIRST_ABLATION_SEED + len(SEEDS))
RESERVED = {*WITH_STRESS, *ABLATION}
LONG = re.compile(r"\d[\d_]{4,}|0[xob]")
# Numbers that are no seeds: where a mirror is driven to, round numbers, and where a range is told.
NO_SEEDS = {
    ("tests/drivers/test_zaber_mirror.py", SEEDS[-1]),
    ("navapp/evaluation/paper/cases.py", FIRST_SEED),
    ("docs/evaluation.md", FIRST_SEED),
    ("docs/evaluation.md", SEEDS[-1]),
    ("navapp/evaluation/stress/axes.py", FIRST_STRESS_SEED),
    ("docs/evaluation.md", FIRST_STRESS_SEED),
    ("docs/evaluation.md", WITH_STRESS[-1]),
    ("navapp/evaluation/paper/cases.py", FIRST_ABLATION_SEED),
    ("docs/evaluation.md", FIRST_ABLATION_SEED),
    ("docs/evaluation.md", ABLATION[-1]),
    ("navapp/ui/line_panel.py", 99_999),
    ("tests/inventory/test_system_checks.py", 99_999),
    ("tests/drivers/test_pjlink_projector.py", 100_000),
    ("tests/drivers/test_protocol_fuzz.py", 100_000),
    ("tests/test_contents_values.py", 100_000),
}


def test_no_reserved_seed_is_short() -> None:
    assert min(RESERVED) >= 10_000


def test_sixty_cases_in_the_papers_order() -> None:
    assert len(ALL_CASES) == len(set(ALL_CASES)) == 3 * 5 * 4
    assert tuple(SAMPLES) == ("man", "woman", "adult")
    assert STAGE_NAMES == ("opening", "drilling", "implant", "patella", "spacer")
    assert tuple(SITUATIONS) == ("registration", "overlay", "patient", "instrument")
    names = [case.name for case in ALL_CASES]
    assert names[:5] == [
        "man-opening-registration", "man-opening-overlay", "man-opening-patient",
        "man-opening-instrument", "man-drilling-registration",
    ]  # fmt: skip
    assert (names[20], names[-1]) == ("woman-opening-registration", "adult-spacer-instrument")


def test_every_test_has_a_seed_and_a_name_of_its_own() -> None:
    tests = list(list_tests(ALL_CASES, MOST_TESTS, FIRST_SEED))
    assert [test.seed for test in tests] == list(SEEDS)
    assert len({test.name for test in tests}) == len(tests)


def test_a_test_keeps_its_seed_whatever_else_is_run() -> None:
    whole = {test.name: test.seed for test in list_tests(ALL_CASES, 5, FIRST_SEED)}
    for case in ALL_CASES[::7]:
        for test in list_tests([case], 2, FIRST_SEED):
            assert whole[test.name] == test.seed
    some = list(list_tests(ALL_CASES[58:], 7, FIRST_SEED))
    assert all(whole.get(test.name, test.seed) == test.seed for test in some)
    assert len(some) == 14


def test_more_tests_than_seeds_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 100"):
        list(list_tests(ALL_CASES, MOST_TESTS + 1, 1))


def test_a_test_configures_its_knee_and_its_situation() -> None:
    tests = {test.name: test for test in list_tests(ALL_CASES, 4, 7)}
    adults = [tests[f"adult-opening-instrument-{n}"].configure().camera for n in range(4)]
    simulated = [camera.simulated for camera in adults]
    assert [one.sex for one in simulated] == ["male", "female", "male", "female"]
    assert [one.side for one in simulated] == ["right", "left", "right", "left"]
    assert {one.age_group for one in simulated} == {"young"}
    assert {(one.motion, one.instrument, one.stepped) for one in simulated} == {
        ("breathing", "sweep", True)
    }
    assert [one.seed for one in simulated] == [7 + 43 * MOST_TESTS + n for n in range(4)]
    woman = tests["woman-spacer-registration-0"].configure().camera.simulated
    assert (woman.sex, woman.age_group, woman.motion, woman.instrument) == (
        "female", "middle", "still", "none",
    )  # fmt: skip
    assert tests["man-drilling-patient-0"].configure().camera.simulated.motion == "patient"
    assert tests["man-drilling-overlay-0"].configure().camera.simulated.instrument == "none"


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_the_instrument_hides_the_bone_of_every_stage_when_it_is_said_to(stage) -> None:
    free, swept = (
        World(Scenario(seed=3, side="left", stage=stage.name, instrument=one, motion="still"))
        for one in ("none", "sweep")
    )

    def find_hidden_share(time_s: float) -> float:
        seen, shown = (
            mask_of(world.depth("left", round(1e9 * time_s), 0.25), stage.bone).sum()
            for world in (swept, free)
        )
        assert shown > 100
        return 1.0 - float(seen) / float(shown)

    first_s, last_s = INSTRUMENT_S
    assert max(find_hidden_share(time_s) for time_s in (0.0, first_s, last_s)) < 0.01
    middle = [find_hidden_share(time_s) for time_s in np.arange(first_s + 0.4, last_s, 0.4)]
    assert max(middle) > 0.2
    assert np.mean(middle) > 0.1
    assert SWEEP_PERIOD_S == 6.0


def integers_of(path: Path) -> Iterator[int]:
    """Those of a file that could be seeds of the evaluation: all of them are long."""
    text = path.read_text(encoding="utf-8")
    if not LONG.search(text):
        return
    if path.suffix == ".py":
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Constant) and type(node.value) is int:
                yield node.value
        # Commands in docstrings and comments.
        text = " ".join(re.findall(r"seed\D{0,3}\d[\d_]*", text))
    for found in re.findall(r"(?<![\w.])\d[\d_]*(?![\w.]*\w)", text):
        yield int(found.replace("_", "") or 0)


def sources() -> Iterator[Path]:
    """All but what the evaluation itself has written."""
    for folder in ("navapp", "drivers", "sim_devices", "calibration", "tests", "docs"):
        for suffix in ("py", "toml", "md"):
            files = sorted((ROOT / folder).rglob(f"*.{suffix}"))
            yield from (file for file in files if file.parent != ROOT / "docs" / "measured")
    yield from (ROOT / name for name in ("README.md", "pyproject.toml"))


def test_no_test_bench_or_default_uses_a_seed_of_the_evaluation() -> None:
    used = {
        (path.relative_to(ROOT).as_posix(), number)
        for path in sources()
        for number in integers_of(path)
        if number in RESERVED and path != Path(__file__)
    }
    assert used - NO_SEEDS == set()


def test_the_ablation_has_seeds_of_its_own() -> None:
    tests = list(list_tests(ALL_CASES, MOST_TESTS, FIRST_ABLATION_SEED))
    assert [test.seed for test in tests] == list(ABLATION)
    assert WITH_STRESS.stop <= FIRST_ABLATION_SEED


def test_a_seed_would_be_found(tmp_path) -> None:
    for name, text in (
        ("a.py", "KneeSpec(@)"),
        ("b.py", '"""navapp run --seed @"""'),
        ("c.toml", "seed = @"),
        ("d.md", "`--seed @`, or more"),
    ):
        for number in (f"{FIRST_SEED}", f"{FIRST_SEED:_}"):
            (tmp_path / name).write_text(text.replace("@", number))
            assert FIRST_SEED in set(integers_of(tmp_path / name)), name

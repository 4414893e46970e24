"""The table of stages, and what a plan makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.control.commands import EnterStage
from navapp.control.stages import STAGES, stage_by_name, stage_by_number, stage_of
from navapp.errors import UsageError
from navapp.overlay import LAYERS
from navapp.preop.contents_file_tables import StagesTable
from navapp.preop.default_targets import with_defaults
from navapp.values import Plan, StageContent, SurgicalContent
from tests.control.fakes import Bench, a_plan
from tests.preop.knees import bones_of, knees


def test_every_stage_shows_the_bone_and_names_only_layers_that_exist() -> None:
    for stage in STAGES:
        assert set(stage.layers) <= set(LAYERS)
        assert {"bone", "scale"} <= set(stage.layers)
    assert set(LAYERS) == {name for stage in STAGES for name in stage.layers}


TARGETS = {"tibia/mine": np.array([[1.0, 2.0, 3.0]])}


def planned(**stages: StageContent) -> Plan:
    return replace(a_plan(), targets=TARGETS, content=SurgicalContent(stages=stages), digest="")


def test_a_stage_follows_the_bone_that_the_plan_names_and_is_judged_there() -> None:
    bench = Bench(plan=planned(drilling=StageContent("tibia", ("tibia/mine",))))
    bench.frames(1)
    entered = bench.do(EnterStage(2)).stage
    assert (entered.name, entered.bone, entered.targets) == ("drilling", "tibia", ("tibia/mine",))
    assert entered.exit == stage_by_number(2).exit
    assert bench.do(EnterStage(3)).stage is stage_by_number(3)


def test_entering_the_stage_that_is_in_force_is_refused() -> None:
    bench = Bench(plan=planned(drilling=StageContent("tibia", ("tibia/mine",))))
    bench.frames(1)
    bench.do(EnterStage(2))
    n_events = len(bench.events)
    assert bench.do(EnterStage(2)).stage.number == 2
    assert len(bench.events) == n_events + 1
    assert bench.refused() == "stage refused: stage 2 drilling is in force already"


def test_the_goal_of_a_bone_is_that_of_the_first_planned_stage_that_follows_it() -> None:
    plan = planned(drilling=StageContent("tibia", ("tibia/mine",)))
    assert stage_of("tibia").name == "spacer"
    assert stage_of("tibia", plan).targets == ("tibia/mine",)
    assert stage_of("femur", plan) is STAGES[0]
    everything = {stage.name: StageContent("femur") for stage in STAGES}
    # A plan without a stage for it leaves the table's.
    assert stage_of("patella", planned(**everything)) is stage_by_name("patella")
    with pytest.raises(UsageError, match="no stage follows"):
        stage_of("fibula", plan)


def test_contents_files_and_default_targets_know_the_stages_of_the_table() -> None:
    names = [stage.name for stage in STAGES]
    assert list(StagesTable.model_fields) == names
    _, stages = with_defaults(bones_of(knees()[0]), {}, {})
    assert {name: one.bone for name, one in stages.items()} == {
        stage.name: stage.bone for stage in STAGES
    }

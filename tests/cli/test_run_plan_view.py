"""The plan that `navapp run` lets a person look at."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from navapp.cli.run import _plan_view
from navapp.preop import PlanOrigin, read_plan, write_plan
from tests.ui import plans


def session_of(path: Path | None, plan: Any) -> Any:
    return SimpleNamespace(
        configuration=SimpleNamespace(plan=SimpleNamespace(path=path)),
        specification=SimpleNamespace(plan=plan),
    )


def test_the_slices_of_a_plan_folder_are_those_of_the_page(tmp_path: Path) -> None:
    view = plans.with_ct()
    write_plan(tmp_path / "plan", view.plan, view.origin, volume=view.volume)
    plan = read_plan(tmp_path / "plan")
    shown = _plan_view(session_of(tmp_path / "plan", plan))
    assert shown.plan is plan
    assert shown.origin == view.origin
    np.testing.assert_array_equal(shown.volume.grey, view.volume.grey)


def test_the_built_in_plan_has_surfaces_alone() -> None:
    shown = _plan_view(session_of(None, plans.make_plan()))
    assert not shown.has_pictures
    assert shown.origin == PlanOrigin()

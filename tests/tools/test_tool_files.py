"""A tool's file: read back as it was, and refused when it is damaged."""

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.tools.paper import Paper
from navapp.tools.plate import Plate
from navapp.tools.tool import Tool
from navapp.tools.tool_files import read_tool, write_tool
from tests.tools.seen_tools import tool_of


def calibrated() -> Tool:
    rng = np.random.default_rng(3)
    tool = tool_of(Plate(first_id=8, faces=2, fold_deg=40.0), axis=(0.0, 0.6, 0.8))
    n = len(tool.paper.mean)
    root = rng.normal(0.0, 0.01, (n, n))
    paper = Paper(rng.normal(0.0, 0.01, n), root @ root.T + 1e-4 * np.eye(n))
    return replace(
        tool, paper=paper, axis_sigma_rad=0.002, made_on=date(2026, 3, 9), rig_id="abc123"
    )


def assert_same(after: Tool, before: Tool) -> None:
    for name in ("plate", "axis_sigma_rad", "made_on", "rig_id"):
        assert getattr(after, name) == getattr(before, name)
    np.testing.assert_array_equal(after.tip_mm, before.tip_mm)
    np.testing.assert_array_equal(after.tip_covariance_mm2, before.tip_covariance_mm2)
    np.testing.assert_array_equal(after.paper.mean, before.paper.mean)
    np.testing.assert_array_equal(after.paper.covariance, before.paper.covariance)
    assert (after.axis is None) == (before.axis is None)
    if before.axis is not None:
        np.testing.assert_array_equal(after.axis, before.axis)


def test_a_tool_comes_back_from_its_file(tmp_path: Path) -> None:
    for tool in (calibrated(), tool_of()):
        write_tool(tmp_path / "tool.json", tool)
        assert_same(read_tool(tmp_path / "tool.json"), tool)


KEYS = (
    "plate", "tip_mm", "tip_covariance_mm2", "axis", "axis_sigma_rad", "paper", "made_on", "rig_id",
)  # fmt: skip


def refusal(path: Path, change: Callable[[dict[str, Any]], object]) -> InputError:
    write_tool(path, calibrated())
    content = json.loads(path.read_text())
    assert set(content) == set(KEYS)
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"tool\.json") as refused:
        read_tool(path)
    assert refused.value.exit_code == 3
    assert "calibrate pivot" in refused.value.remedy
    return refused.value


@pytest.mark.parametrize("key", KEYS)
def test_a_missing_key_is_named(key: str, tmp_path: Path) -> None:
    assert f"lacks '{key}'" in str(refusal(tmp_path / "tool.json", lambda all_: all_.pop(key)))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("plate", {"type": "board"}, 'type must be "plate"'),
        ("tip_mm", [1.0, 2.0], r"(3,) finite numbers are expected"),
        ("tip_mm", [1.0, 2.0, float("nan")], r"(3,) finite numbers are expected"),
        ("tip_mm", [1.0, 2.0, "far"], "cannot be understood"),
        ("tip_mm", None, "finite numbers are expected"),
        ("tip_covariance_mm2", np.eye(2).tolist(), "(3, 3) finite numbers are expected"),
        ("tip_covariance_mm2", (-np.eye(3)).tolist(), "a covariance is not one"),
        ("tip_covariance_mm2", np.zeros((3, 3)).tolist(), "a covariance is not one"),
        ("tip_covariance_mm2", (np.eye(3) + np.eye(3, k=1)).tolist(), "a covariance is not one"),
        ("axis", [0.0, 0.0, 1.1], "the axis is not a unit vector"),
        ("axis", [0.0, 1.0], "finite numbers are expected"),
        ("axis_sigma_rad", -0.1, "axis_sigma_rad is not an angle"),
        ("axis_sigma_rad", float("nan"), "axis_sigma_rad is not an angle"),
        ("axis_sigma_rad", None, "cannot be understood"),
        ("paper", [], "cannot be understood"),
        ("paper", {"mean": [0.0], "covariance": [[1.0]]}, "finite numbers are expected"),
        ("made_on", "yesterday", "cannot be understood"),
        ("made_on", 20260309, "cannot be understood"),
        ("plate", None, "cannot be understood"),
        ("plate", ["plate"], "cannot be understood"),
    ],
)
def test_what_no_tool_has_is_refused(key: str, value: object, words: str, tmp_path: Path) -> None:
    refused = refusal(tmp_path / "tool.json", lambda all_: all_.update({key: value}))
    assert words in str(refused)


def test_paper_of_another_plate_is_refused(tmp_path: Path) -> None:
    def one_face_less(content: dict[str, Any]) -> None:
        content["plate"]["faces"] = 1

    assert "finite numbers" in str(refusal(tmp_path / "tool.json", one_face_less))


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"3", b'{"plate"', b"\xff\xfe"],
    ids=["empty", "a list", "a number", "cut off", "no text"],
)  # fmt: skip
def test_a_damaged_file_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "tool.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot be understood") as refused:
        read_tool(path)
    assert refused.value.subject == str(path)


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_tool(tmp_path / "tool.json")

"""The tools that a configuration names."""

from pathlib import Path

import numpy as np
import pytest

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.session_tools import read_tools
from navapp.config import Configuration
from navapp.errors import ConfigurationError, InputError
from navapp.tools.paper import as_designed
from navapp.tools.plate import Plate
from navapp.tools.tool import Tool
from navapp.tools.tool_files import write_tool
from tests.control.fakes import a_rig

AXIS = np.array([0.0, 0.6, 0.8])


def a_tool(first_id: int = 0, axis: np.ndarray | None = None, rig_id: str = "") -> Tool:
    plate = Plate(first_id=first_id)
    return Tool(
        plate, as_designed(plate), np.array([0.0, 75.0, 110.0]), 1e-4 * np.eye(3), axis, 0.001,
        rig_id=rig_id,
    )  # fmt: skip


def configured(tmp_path: Path, **tools: Tool) -> Configuration:
    for name, tool in tools.items():
        write_tool(tmp_path / f"{name}.json", tool)
    files = {name: str(tmp_path / f"{name}.json") for name in tools}
    return Configuration.model_validate({"tools": files})


def test_named_tools_are_read(tmp_path) -> None:
    configuration = configured(tmp_path, pointer=a_tool(), drill=a_tool(8, AXIS))
    tools = read_tools(configuration.tools.files, a_rig(), Diagnostics())
    assert list(tools) == ["pointer", "drill"]
    np.testing.assert_allclose(tools["drill"].axis, AXIS)
    assert read_tools({}, a_rig(), Diagnostics()) == {}


@pytest.mark.parametrize(
    ("tools", "words"),
    [
        ({"drill": a_tool()}, "the drill's axis is not known"),
        ({"pointer": a_tool(), "drill": a_tool(3, AXIS)}, "carry the same markers"),
    ],
)
def test_tools_that_cannot_be_used_are_refused(tmp_path, tools, words) -> None:
    with pytest.raises(ConfigurationError, match=words):
        read_tools(configured(tmp_path, **tools).tools.files, a_rig(), Diagnostics())


def test_a_missing_file_is_named() -> None:
    configuration = Configuration.model_validate({"tools": {"pointer": "nowhere.json"}})
    with pytest.raises(InputError, match=r"nowhere.json does not exist"):
        read_tools(configuration.tools.files, a_rig(), Diagnostics())


@pytest.mark.parametrize("is_same", [True, False])
def test_a_tool_of_another_rig_is_told(tmp_path, capsys, is_same) -> None:
    rig = a_rig()
    tool = a_tool(rig_id=rig.rig_id if is_same else "other")
    read_tools(configured(tmp_path, pointer=tool).tools.files, rig, Diagnostics())
    assert ("calibrated with another rig" in capsys.readouterr().err) is not is_same

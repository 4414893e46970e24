"""The tools that a session looks for."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from navapp.cli.diagnostics import Diagnostics
from navapp.errors import ConfigurationError

if TYPE_CHECKING:
    from navapp.geometry.rig import StereoRig
    from navapp.tools.tool import Tool, ToolKind


def read_tools(
    files: Mapping[str, str], rig: "StereoRig", diagnostics: Diagnostics
) -> "dict[ToolKind, Tool]":
    """Read the files of tools, by their kind.

    Raises:
        InputError: a file; ConfigurationError: two tools with the same markers, or a drill of which
            nobody knows the axis.
    """
    from navapp.tools.tool import TOOL_KINDS
    from navapp.tools.tool_files import read_tool

    tools = {kind: read_tool(files[kind]) for kind in TOOL_KINDS if kind in files}
    if "drill" in tools and tools["drill"].axis is None:
        raise ConfigurationError(
            "the drill's axis is not known",
            subject="tools.drill",
            remedy="calibrate it with `navapp calibrate pivot --tool drill`",
        )
    if len(tools) == 2:
        plates = [tool.plate for tool in tools.values()]
        is_same = plates[0].dictionary == plates[1].dictionary
        if is_same and set(plates[0].ids) & set(plates[1].ids):
            raise ConfigurationError(
                "pointer and drill carry the same markers",
                subject="tools",
                remedy="give one of their plates another first_id, print and calibrate it",
            )
    for kind, tool in tools.items():
        if tool.rig_id and tool.rig_id != rig.rig_id:
            diagnostics.warn(f"the {kind} was calibrated with another rig")
    return tools

"""Follows the session's tools, and says how they stand to the bone and the plan."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.frames import StereoFrame
from navapp.control.states import ToolLine, ToolReading
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import luma
from navapp.geometry.rig import StereoRig
from navapp.tools.surface_distance import SurfaceDistance
from navapp.tools.tool import SeenTool, Tool, ToolKind
from navapp.tools.tool_on_bone import ToolOnBone, place_on_bone
from navapp.tools.tool_tracker import ToolTracker
from navapp.values import Plan, StageSpec, Status, TrackedFrame

# A tool that was not seen lately is looked for in every so many frames: that takes longer.
_LOOK_EVERY = 5


@dataclass
class _Followed:
    """One tool, as it was found last."""

    tracker: ToolTracker
    missing: str = "it was not looked for yet"
    reading: ToolReading | None = None
    read_ns: int = 0  # capture of the pair of that reading
    wait: int = 0  # frames until it is looked for again


class ToolWatch:
    """Follows tools into every frame; asked from the session's loop alone.

    Args:
        tools: that are looked for.
        rig: that looks.
        plan: of the operation.
    """

    def __init__(self, tools: Mapping[ToolKind, Tool], rig: StereoRig, plan: Plan) -> None:
        self._plan, self._tools = plan, dict(tools)
        # They are not looked for in the same frame.
        self._followed = {
            kind: _Followed(ToolTracker(tool, rig), wait=2 * number)
            for number, (kind, tool) in enumerate(tools.items())
        }
        self._surface: tuple[str, int, SurfaceDistance] | None = None

    @property
    def kinds(self) -> tuple[ToolKind, ...]:
        """Of the tools that are looked for."""
        return tuple(self._followed)

    def tip_sigma_mm(self, kind: ToolKind) -> float:
        """Largest standard deviation of a tool's calibrated tip; 0 without the tool."""
        tool = self._tools.get(kind)
        if tool is None:
            return 0.0
        return float(np.sqrt(np.linalg.eigvalsh(tool.tip_covariance_mm2)[-1]))

    def follow(
        self,
        frame: StereoFrame,
        tracked: TrackedFrame | None,
        stage: StageSpec,
        version: int,
        surface: TriangleMesh | None,
    ) -> dict[ToolKind, ToolReading]:
        """Look for the tools in a frame.

        Args:
            frame: the next one.
            tracked: the stage's bone in it, when it is accepted.
            stage: in force.
            version: of the bone's model.
            surface: what is left of the bone; None: all.

        Returns:
            What was read in this very frame.
        """
        if not self._followed:
            return {}
        due = [kind for kind, one in self._followed.items() if self._is_due(one)]
        if not due:
            return {}
        pictures = luma(frame.left), luma(frame.right)
        read: dict[ToolKind, ToolReading] = {}
        for kind in due:
            one = self._followed[kind]
            found = one.tracker.track(pictures, frame.captured_ns)
            if not isinstance(found, SeenTool):
                one.missing = found.why
                one.wait = 0 if one.reading is not None else _LOOK_EVERY - 1
                one.reading = None
                continue
            one.missing, one.wait = "", 0
            placed = self._place(found, tracked)
            one.reading = self._read(found, placed, stage, version, surface)
            one.read_ns = frame.captured_ns
            read[kind] = one.reading
        return read

    def describe(self, now_ns: int) -> tuple[ToolLine, ...]:
        """How the tools stand, as of now."""
        return tuple(
            ToolLine(
                kind,
                one.reading,
                one.missing,
                None if one.reading is None else max(now_ns - one.read_ns, 0) / 1e6,
            )
            for kind, one in self._followed.items()
        )

    def find_surface(
        self, bone: str, version: int, surface: TriangleMesh | None
    ) -> SurfaceDistance:
        """Of what is left of a bone; made once a version."""
        if self._surface is None or self._surface[:2] != (bone, version):
            seen = surface or self._plan.bones[bone].make_seen_surface()
            self._surface = bone, version, SurfaceDistance(seen)
        return self._surface[2]

    @staticmethod
    def _is_due(one: _Followed) -> bool:
        if one.wait > 0:
            one.wait -= 1
            return False
        return True

    def _place(self, seen: SeenTool, tracked: TrackedFrame | None) -> ToolOnBone | None:
        """In the bone's coordinates, as long as the bone's pose may be believed."""
        if tracked is None or tracked.estimate is None or tracked.verdict.status is not Status.OK:
            return None
        middle_mm = self._plan.bones[tracked.bone].mesh.vertices_mm.mean(axis=0)
        return place_on_bone(seen, tracked.bone, tracked.estimate, middle_mm)

    def _read(
        self,
        seen: SeenTool,
        placed: ToolOnBone | None,
        stage: StageSpec,
        version: int,
        surface: TriangleMesh | None,
    ) -> ToolReading:
        if placed is None:
            return ToolReading(seen, None)
        distance_mm, _, _ = self.find_surface(placed.bone, version, surface).find(placed.tip_mm)
        holes = {}
        if "drills" in stage.layers:
            holes = self._plan.of_stage(self._plan.content.drills, "drills", stage)
        offsets = [placed.hole_offset(name, hole) for name, hole in holes.items()]
        return ToolReading(
            seen,
            placed,
            distance_mm,
            placed.nearest(self._plan.landmarks_of(placed.bone)),
            min(offsets, key=lambda one: np.hypot(one.off_mm, one.depth_mm), default=None),
        )

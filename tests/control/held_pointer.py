"""A pointer for sessions on fakes: its tip is where the test says."""

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.tools.paper import as_designed
from navapp.tools.plate import Plate
from navapp.tools.tool import SeenTool, Tool
from navapp.tools.tool_tracker import ToolTracker, Unseen

PLATE = Plate()
TIP_MM = np.array([0.0, 75.0, 110.0])
POINTER = Tool(PLATE, as_designed(PLATE), TIP_MM, 1e-4 * np.eye(3))


class HeldPointer:
    """Stands for what is seen of a pointer.

    Attributes:
        tip_mm: (3,) in the left camera; None: it is not seen.
        n_looks: how often it was looked for.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tip_mm: np.ndarray | None = None
        self.n_looks = 0
        monkeypatch.setattr(ToolTracker, "track", self._track)

    def _track(self, pictures, captured_ns: int) -> SeenTool | Unseen:
        self.n_looks += 1
        if self.tip_mm is None:
            return Unseen("no marker is seen by both cameras")
        pose = RigidTransform.from_parts("left", "plate", np.eye(3), self.tip_mm - TIP_MM)
        covariance = np.diag([1e-4] * 3 + [1e-8] * 3)
        return SeenTool(POINTER, pose, covariance, 1.0, captured_ns)

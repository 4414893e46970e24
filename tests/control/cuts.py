"""A plan with cuts for sessions on fakes, and faces that are measured as a test says."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.resection import FaceMeter
from navapp.values import MeasuredFace, Plan, ResectionPlane, SurgicalContent
from tests.control.fakes import a_plan

# Across the bowl of the plan's bones: beyond it lies its rim.
TOP = ResectionPlane("femur", np.array([0.0, 0.0, 8.0]), np.array([0.0, 0.0, 1.0]), (100.0, 100.0))
SIDE = ResectionPlane(
    "femur", np.array([25.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), (100.0, 100.0)
)


def cut_plan() -> Plan:
    planes = {"top": TOP, "side": SIDE, "flat": replace(TOP, bone="tibia")}
    return replace(a_plan(), content=SurgicalContent(planes=planes), digest="")


class Faces:
    """Stands for what is measured of faces: by name, None is not seen."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.shares: dict[str, float | None] = {}
        self.expected: list[ResectionPlane | None] = []
        self.offset_mm = -0.4
        monkeypatch.setattr(FaceMeter, "measure", self._measure)

    def _measure(
        self, left, right, estimate, planned, others, expected=None
    ) -> MeasuredFace | None:
        self.expected.append(expected)
        share = self.shares.get("top" if planned is TOP else "side")
        if share is None:
            return None
        little = np.diag([2e-6, 2e-6, 2e-3])
        return MeasuredFace(planned, np.array([0.01, 0.0, self.offset_mm]), little, share)

"""A small plan with slices for the tests of the screen: no side of it mirrors another."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.preop import PlanOrigin, PlanView, make_even_cartilage, make_plan_view
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import make_grid
from navapp.values import BoneModel, Landmark, Plan, SurgicalContent
from tests.geometry.shapes import sphere

# The landmark lies to the patient's right, in front and towards the head.
LANDMARK_MM = np.array([-12.0, -6.0, 9.0])
WARNINGS = ("fibula: not found in the CT",)
_BRIGHT, _FLESH = 200, 60


def make_plan() -> Plan:
    """A ball as femur, a smaller one below and behind it as tibia."""
    ball = sphere(16.0, 24)
    lower = sphere(9.0, 16)
    moved = TriangleMesh(np.add(lower.vertices_mm, (6.0, 8.0, -26.0)), lower.faces)
    return Plan(
        {
            "femur": make_even_cartilage(BoneModel("femur", ball, "right"), 2.0, 0.5),
            "tibia": BoneModel("tibia", moved, "right"),
        },
        {"tibia/plateau": np.array([[6.0, 8.0, -17.0], [9.0, 9.0, -18.0]])},
        name="small knee",
        content=SurgicalContent(landmarks={"femur/notch": Landmark(LANDMARK_MM, None, "contents")}),
    )


def with_ct() -> PlanView:
    """Its bones bright in flesh; air to the patient's left."""
    plan = make_plan()
    grid = make_grid([bone.mesh for bone in plan.bones.values()])
    z, y, x = np.meshgrid(*(np.arange(n) for n in grid.size[::-1]), indexing="ij")
    points = np.stack([x, y, z], axis=-1) * grid.step_mm + grid.origin_mm
    grey = np.where(points[..., 0] < 20.0, _FLESH, 0)
    grey[np.linalg.norm(points, axis=-1) < 16.0] = _BRIGHT
    grey[np.linalg.norm(points - (6.0, 8.0, -26.0), axis=-1) < 9.0] = _BRIGHT
    volume = SliceVolume(grid, grey.astype(np.uint8), (-200.0, 1400.0))
    origin = PlanOrigin(
        "CT", "knee", (0.5, 0.5, 0.8), (300, 300, 200), 200.0, 1210.0, warnings=WARNINGS
    )
    return make_plan_view(plan, origin, volume)


def without_ct() -> PlanView:
    """Its surfaces alone."""
    return make_plan_view(make_plan())

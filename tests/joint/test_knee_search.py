"""A simulated tibia found from its femur alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.joint import KneeSearch, OccludedTracker
from navapp.joint.knee_search import _measure_spread
from navapp.limb import Hinge
from navapp.tracking import Goal, make_tracker
from navapp.values import BoneModel, Reason, Status
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee
from tests.many import few_rows_of

GOAL = Goal(np.empty((0, 3)), 2.0)
# Seeds, and what is said against the pose: tissue that continues a bone's surface leaves doubt.
KNEES = [(1405, ()), (1406, ()), (1408, (Reason.SURFACE_MISFIT, Reason.POSE_UNCERTAIN))]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "reasons"), few_rows_of(KNEES))
def test_a_tibia_is_found_from_the_femur_and_a_search_can_be_stopped(
    seed: int, reasons: tuple[Reason, ...]
) -> None:
    knee = SimulatedKnee(Scenario(seed=seed, side="left" if seed % 2 else "right"))
    meshes = {
        name: TriangleMesh(mesh.vertices_mm, mesh.faces)
        for name, mesh in knee.world.anatomy.bones.items()
    }
    frame = knee.frames(1)[0]
    true = {
        name: knee.oracle.left_from_body(name, frame.captured_ns) for name in ("femur", "tibia")
    }
    bone = BoneModel("tibia", meshes["tibia"], knee.world.scenario.side)
    tracker = make_tracker(knee.rig, bone)
    hidden = OccludedTracker(tracker, meshes["femur"], true["femur"])
    search = KneeSearch(Hinge.of(meshes["femur"]))
    told: list[float] = []
    found = search.find(hidden, frame, true["femur"], GOAL, told.append)
    tracked = found.tracked
    error_mm = compute_mean_tre_mm(tracked.left_from_bone, true["tibia"], bone, GOAL.targets_mm)
    # The plain tracker's own search would call it ambiguous: that is not what was asked.
    assert tracked.verdict.reasons == reasons
    assert tracked.verdict.status is (Status.DEGRADED if reasons else Status.OK)
    assert error_mm < min(0.4, tracked.verdict.predicted_tre_mm)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert (np.linalg.eigvalsh(found.spread) > -1e-12).all()

    class StopError(Exception):
        pass

    def stop(share: float) -> None:
        if share > 0.0:
            raise StopError

    with pytest.raises(StopError):
        search.find(hidden, frame, true["femur"], GOAL, stop)


@pytest.mark.parametrize(("n", "times"), [(1, 6.48), (4, 1.416), (9, 1.154)])
def test_few_places_tell_a_spread_only_roughly(n: int, times: float) -> None:
    """Student's t at 95 % over that of a normal distribution."""
    centre_mm, best = np.zeros(3), fit_at(0.0)
    beside = [fit_at(0.2 * (-1.0) ** k) for k in range(n)]
    spread = _measure_spread([best, *beside, fit_at(30.0)], best, centre_mm)
    assert np.sqrt(spread[0, 0]) == pytest.approx(0.2 * times, rel=0.01)
    assert np.count_nonzero(spread) == 1
    assert not _measure_spread([best, fit_at(30.0)], best, centre_mm).any()


def fit_at(x_mm: float) -> SimpleNamespace:
    place_mm = (x_mm, 0.0, 400.0)
    return SimpleNamespace(
        pose=RigidTransform.from_parts("left_rect", "tibia", np.eye(3), place_mm)
    )

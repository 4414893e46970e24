"""Pictures of one bone with the truth about it: what every method is given alike."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from drivers.frames import StereoFrame
from navapp.config import Configuration
from navapp.control.stages import stage_by_name
from navapp.devices import open_live
from navapp.devices.simulated_plan import make_built_in_plan, make_nominal_prior
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import Plan, Prior, StageSpec


@dataclass(frozen=True, slots=True, eq=False)
class KnownSequence:
    """Frames, what a session needs to follow the bone in them, and where it really was."""

    frames: Sequence[StereoFrame]
    # Left camera from bone when each frame showed it; None where nobody knows. It is read after
    # a method has answered, and given to none.
    truth: Sequence[RigidTransform | None]
    configuration: Configuration
    rig: StereoRig
    plan: Plan
    prior: Prior
    stage: StageSpec
    made_steps: tuple[str, ...] = ()  # of the plan, made before the first frame
    is_simulated: bool = True
    # (N, 3) where the stage's targets really are in the bone; None: where the plan has them.
    true_targets_mm: FloatArray | None = None


def render_room(configuration: Configuration, stage_name: str, n_frames: int) -> KnownSequence:
    """The pictures of a simulated room; the stage is shown as it is usually entered."""
    with ExitStack() as undo:
        opened = open_live(configuration, is_headless=True)
        undo.callback(opened.devices.close)
        simulation = opened.simulation
        if simulation is None:
            raise AssertionError("the configuration of a test names the simulated camera")
        plan = make_built_in_plan(simulation)
        stage = plan.stage(stage_by_name(stage_name))
        made = simulation.states.set_stage(stage.name)
        frames = [opened.devices.camera.read(1.0) for _ in range(n_frames)]
        truth = [
            simulation.oracle.left_from_seen_body(stage.bone, frame.captured_ns) for frame in frames
        ]
        return KnownSequence(
            frames,
            truth,
            configuration,
            opened.rig,
            plan,
            make_nominal_prior(simulation),
            stage,
            tuple(sorted(made & set(plan.content.steps))),
        )

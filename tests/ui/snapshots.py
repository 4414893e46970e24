"""Fixed snapshots, a synthetic picture and a scripted session for the tests of the screen."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.control.commands import Command
from navapp.control.stages import STAGES
from navapp.control.states import (
    CandidateLine,
    ConditionLine,
    DeviceHealth,
    DeviceLine,
    Event,
    EventLevel,
    Progress,
    Rates,
    SessionState,
    Snapshot,
)
from navapp.values import Reason, Status, Verdict

S = 1_000_000_000
START_NS = 5_000 * S


def picture(phase: float = 0.0, height: int = 90, width: int = 160) -> NDArray[np.uint8]:
    """A bright knee-like blob on a dark red ground with a green outline, BGR, in few tones."""
    y, x = np.mgrid[0:height, 0:width].astype(float)
    cx, cy = width / 2 + 12 * np.sin(phase), height / 2 + 6 * np.cos(phase)
    radius = np.hypot((x - cx) / 1.25, y - cy) / (0.36 * height)
    notch = np.hypot((x - cx) / 0.5, y - cy - 0.3 * height) / (0.2 * height)
    ground = 45 + 25 * np.rint(np.sin(x / 19 + phase) * np.cos(y / 13))
    bone = (radius < 1) & (notch > 1)
    shade = np.clip(235 - 40 * np.floor(3 * radius**2), 0, 255)
    image = np.stack([ground * 0.55, ground * 0.5, ground * 1.5], axis=-1)
    image[bone] = np.stack([shade * 0.72, shade * 0.86, shade], axis=-1)[bone]
    outline = (np.abs(radius - 1.0) < 0.035) & (notch > 1)
    image[outline] = (110, 255, 90)
    axis = (np.abs(x - cx) < 0.8) & (y > cy - 0.2 * height) & (y < cy + 0.1 * height)
    image[axis] = (40, 190, 255)
    return np.asarray(np.clip(image, 0, 255), dtype=np.uint8)


DEVICES = (
    DeviceLine("camera", "simulated stereo", DeviceHealth.OK, "1280 x 720, 30 fps"),
    DeviceLine("display", "simulated", DeviceHealth.OK, "1920 x 1080"),
    DeviceLine("projector", "none", DeviceHealth.ABSENT),
    DeviceLine("mirror", "fixed", DeviceHealth.OK, "45.0 deg"),
)

RATES = Rates(
    frames_per_s=29.9,
    latency_ms=24.3,
    fps_history=tuple(29.0 + np.sin(i / 3) for i in range(40)),
    latency_history_ms=tuple(24.0 + 6 * np.sin(i / 2) for i in range(40)),
    n_frames=1842,
    n_dropped=3,
    skew_ms=0.4,
)

EVENTS = (
    Event(START_NS, "state", "session started on the simulated rig"),
    Event(
        START_NS + 14 * S, "register", "registration started from the session's prior", sequence=12
    ),
    Event(START_NS + 20 * S, "reject", "candidate rejected by the operator", sequence=180),
    Event(START_NS + 29 * S, "accept", "registration accepted, predicted 0.19 mm", sequence=440),
    Event(START_NS + 31 * S, "stage", "stage 2 drilling entered by the operator", sequence=512),
)

GOOD = Verdict(
    status=Status.OK,
    predicted_tre_mm=0.21,
    coverage=0.71,
    occluded_fraction=0.12,
    inlier_fraction=0.93,
    rms_mm=0.18,
    expected_rms_mm=0.17,
)


def condition(name: str, text: str, minutes: int | None = None) -> ConditionLine:
    """One that a person answers for, confirmed so many minutes ago or open."""
    note = "" if minutes is None else f"confirmed {minutes} min ago"
    return ConditionLine(name, text, minutes is not None, is_personal=True, note=note)


TIME_OUT = (
    condition("patient", "this is the plan's patient: knee phantom", 3),
    condition("side", "this is the plan's side: RIGHT", 3),
    ConditionLine("rig", "the rig is calibrated", is_met=True),
)
GATE = (
    condition("entry_point", "the entry point was checked with the tip", 1),
    ConditionLine("femoral_guide", "hole femoral_guide drilled", False, note="not confirmed"),
    condition("checked_on_patient", "checked on the patient: known points lie where shown"),
)


def navigating(**changes: Any) -> Snapshot:
    """Stage 2, all well."""
    snapshot = Snapshot(
        time_ns=START_NS + 62 * S,
        state=SessionState.NAVIGATING,
        stage=STAGES[1],
        stages=STAGES,
        reasons=(),
        verdict=GOOD,
        pose_age_ms=18.0,
        picture=picture(),
        time_out=TIME_OUT,
        gate=GATE,
        rates=RATES,
        devices=DEVICES,
        events=EVENTS,
        rig_name="simulated rig",
        is_simulated=True,
        plan_name="knee phantom",
        plan_digest="7f3a09c1d2e4",
        side="right",
        sequence=1842,
    )
    return dataclasses.replace(snapshot, **changes)


def suspended(**changes: Any) -> Snapshot:
    """The bone is covered and the camera was lost for a while."""
    reasons = (Reason.BONE_LOST, Reason.COVERAGE_LOW, Reason.TRE_TOO_LARGE)
    verdict = Verdict(Status.LOST, 1.62, reasons[1:], 0.29, 0.55, 0.71, 0.44, 0.19)
    alarm = Event(START_NS + 60 * S, "guides", "guides hidden: clear the view", EventLevel.ALARM)
    values: dict[str, Any] = {
        "state": SessionState.SUSPENDED,
        "reasons": reasons,
        "verdict": verdict,
        "events": (*EVENTS, alarm),
        "devices": (
            DEVICES[0],
            DeviceLine("display", "window", DeviceHealth.LOST, "no heartbeat for 1.2 s"),
            *DEVICES[2:],
        ),
    }
    return navigating(**{**values, **changes})


def review(**changes: Any) -> Snapshot:
    """A candidate waits."""
    values: dict[str, Any] = {
        "state": SessionState.REVIEW,
        "stage": STAGES[0],
        "reasons": (Reason.NOT_NAVIGATING,),
        "candidate_id": 4,
        "verdict": dataclasses.replace(GOOD, predicted_tre_mm=0.34),
    }
    return navigating(**{**values, **changes})


def starting(**changes: Any) -> Snapshot:
    """Before the first picture."""
    values: dict[str, Any] = {
        "time_ns": START_NS + S,
        "state": SessionState.STARTING,
        "stage": STAGES[0],
        "reasons": (Reason.NOT_NAVIGATING, Reason.CAMERA_SILENT),
        "verdict": None,
        "pose_age_ms": None,
        "picture": None,
        "rates": Rates(),
        "events": EVENTS[:1],
        "progress": Progress("compiling the kernels, the first start only", 0.42),
    }
    return navigating(**{**values, **changes})


def registering(**changes: Any) -> Snapshot:
    """The first registration runs."""
    values: dict[str, Any] = {
        "state": SessionState.REGISTERING,
        "stage": STAGES[0],
        "reasons": (Reason.NOT_NAVIGATING,),
        "verdict": None,
        "progress": Progress("registering: trying 24 starts", 0.6),
    }
    return navigating(**{**values, **changes})


def blanked(**changes: Any) -> Snapshot:
    """Dark by the operator's will."""
    return navigating(**{"is_blanked": True, "reasons": (Reason.BLANKED,), **changes})


def compared(**changes: Any) -> Snapshot:
    """Three candidates wait, the second one is under review."""
    bounds_mm = (0.34, 0.41, 1.2)
    candidates = tuple(
        CandidateLine(
            number,
            dataclasses.replace(GOOD, predicted_tre_mm=bound_mm, coverage=0.8 - 0.1 * number),
            number == 2,
            picture(phase=float(number))[10:80, 30:130],
        )
        for number, bound_mm in enumerate(bounds_mm, start=1)
    )
    return review(**{"candidates": candidates, "residual_picture": picture(2.0), **changes})


class ScriptedSession:
    """Gives what it is told to give, keeps what it is sent."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.current = snapshot
        self.commands: list[Command] = []
        self.n_stopped = 0

    def snapshot(self) -> Snapshot:
        return self.current

    def submit(self, command: Command) -> None:
        self.commands.append(command)

    def stop(self) -> None:
        self.n_stopped += 1

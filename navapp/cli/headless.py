"""A session without a screen: what `run --headless` and `replay` share."""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import date
from typing import Any

import numpy as np

from navapp.cli.compiling import tell_kernels
from navapp.cli.diagnostics import Diagnostics, write_json
from navapp.cli.operation_table import StepResult, format_steps, steps_to_json
from navapp.cli.results import (
    frame_text,
    reasons_text,
    summarise,
    summarise_gaps,
    summarise_measured,
    summary_text,
)
from navapp.control.controller import SessionController
from navapp.control.frame_result import FrameResult
from navapp.control.operators import Operator
from navapp.control.runner import run_headless
from navapp.errors import NavappError, PriorError, ResultError, RigError
from navapp.geometry.compilation import watch_compilation
from navapp.geometry.rig import StereoRig
from navapp.limb import LimbMeasurement
from navapp.values import Measured, Prior

_NO_PICTURE = np.empty((0, 0, 3), dtype=np.uint8)


def check_accepted(rig: StereoRig, is_allowed: bool, diagnostics: Diagnostics) -> None:
    """Refuse a rig that its calibration did not accept, unless it is allowed.

    Raises:
        RigError: not accepted and not allowed; or not in mm.
    """
    if rig.quality is None:
        if not rig.name.startswith("sim:"):
            diagnostics.warn(f"rig {rig.name} carries no quality record; it is taken as given")
        return
    if rig.quality.length_unit != "mm":
        raise RigError(
            f"rig {rig.name} is measured in {rig.quality.length_unit}s of its board, not in mm",
            subject=rig.name,
            remedy="give the board's true size and calibrate again",
        )
    if rig.quality.is_accepted:
        return
    why = "; ".join(rig.quality.reasons) or "no reason is recorded"
    if not is_allowed:
        raise RigError(
            f"rig {rig.name} was not accepted by its calibration ({why})",
            subject=rig.name,
            remedy="calibrate again, or add --allow-unaccepted: no frame is OK then",
        )
    diagnostics.warn(f"rig {rig.name} was not accepted ({why}): no frame will be OK")


def check_not_expired(rig: StereoRig, today: date) -> None:
    """Refuse to work with a rig whose time is over; what was recorded with it stays good.

    Raises:
        RigError: expired.
    """
    if rig.quality is None or not rig.quality.has_expired(today):
        return
    raise RigError(
        f"rig {rig.name} expired on {rig.quality.expires_on}",
        subject=rig.name,
        remedy="calibrate again: cameras move with time, and nothing shows it",
    )


# Option -> what it has written.
_FILES = {
    "record": "recorded session",
    "json": "frames and summary",
    "overlay": "overlay pictures",
    "video": "video",
}


def check_start(prior: Prior, bone: str) -> None:
    """Refuse a session in which nothing could ever be found.

    Raises:
        PriorError: nothing is known of where the bone is.
    """
    if not prior.has_start(bone):
        raise PriorError(
            f"nothing is known of where the {bone} is",
            remedy="give --prior FILE with camera_from_model"
            + ("" if bone == "femur" else f"_{bone}")
            + ", or with the box that `navapp prior` takes",
        )


class FrameLog:
    """Listens to a controller: keeps every result without its pictures, and tells how far it is.

    Args:
        n_expected: so many frames, None when that is not known.
        diagnostics: takes the progress and, when verbose, a line a frame.
        describe: makes that line; None: the usual one. Where it is given, every frame has its line.
    """

    def __init__(
        self,
        n_expected: int | None,
        diagnostics: Diagnostics,
        describe: Callable[[FrameResult], str] | None = None,
    ) -> None:
        self.results: list[FrameResult] = []
        self._n_expected = n_expected
        self._diagnostics, self._describe = diagnostics, describe
        self._started = time.perf_counter()

    def __call__(self, result: FrameResult) -> None:
        """A frame was handled."""
        # A long session must not grow by its pictures, nor by views into them.
        frame = replace(result.frame, left=_NO_PICTURE, right=_NO_PICTURE)
        picture = replace(result.picture, image=_NO_PICTURE)
        self.results.append(replace(result, frame=frame, picture=picture))
        if self._describe is not None:
            self._diagnostics.note(self._describe(result))
            return
        self._diagnostics.detail(frame_text(result))
        self._diagnostics.tell_live(self._line(result), is_last=self.is_full)

    def _line(self, result: FrameResult) -> str:
        """How far it is."""
        n, expected = len(self.results), self._n_expected
        far = f"frame {n}" if expected is None else f"frame {n} of {expected}"
        rate = n / max(time.perf_counter() - self._started, 1e-3)
        word = "" if result.tracked is None else f" {result.tracked.verdict.status.value}"
        return f"{far}, {rate:.1f} a second: {result.state.value}{word}"

    @property
    def has_end(self) -> bool:
        """It is known how many frames are to come."""
        return self._n_expected is not None

    @property
    def is_full(self) -> bool:
        """All frames that are expected have come."""
        return self._n_expected is not None and len(self.results) >= self._n_expected


def run_session(
    controller: SessionController, operator: Operator, log: FrameLog, diagnostics: Diagnostics
) -> float:
    """Run to the end of the source, or until the log is full; answers with the seconds it took.

    A session without an end is ended by an interrupt, and its result is told as any other's.
    """
    started = time.perf_counter()
    with watch_compilation(tell_kernels(diagnostics)) as compilation:
        try:
            run_headless(controller, operator, lambda: log.is_full)
        except KeyboardInterrupt:
            if log.has_end:
                raise
    seconds = time.perf_counter() - started
    if not log.is_full:
        diagnostics.tell_live(f"{len(log.results)} frames", is_last=True)
    if compilation.count:
        diagnostics.note(
            f"kernels compiled meanwhile: {compilation.count}; the next session is quicker"
        )
    return seconds


def _say_what_was_written(options: argparse.Namespace, diagnostics: Diagnostics) -> None:
    """Where the options had files of a session put."""
    for name, what in _FILES.items():
        path = getattr(options, name, None)
        if path not in (None, "-"):
            diagnostics.say(f"{what}: {path}")


def report_result(
    frames: Sequence[dict[str, Any]],
    seconds: float,
    failure: NavappError | None,
    options: argparse.Namespace,
    diagnostics: Diagnostics,
    rig: dict[str, Any] | None = None,
    measured: Sequence[Mapping[str, Measured]] = (),
    limbs: Sequence[LimbMeasurement | None] = (),
    steps: Sequence[StepResult] = (),
) -> int:
    """Write the result, tell its summary, and answer with the exit code.

    Args:
        frames: entries of the result.
        seconds: that they took.
        failure: the fault that the session ended in, or None.
        options: of the verb.
        diagnostics: takes the summary.
        rig: what a live session found out about its rig.
        measured: cuts and holes, as each frame has measured them.
        limbs: what femur and tibia said together in each frame.
        steps: what was planned, made and measured.

    Raises:
        NavappError: that fault.
        ResultError: no frame was OK.
    """
    summary = {**summarise(frames, seconds), "measured": summarise_measured(measured)}
    if any(limb is not None for limb in limbs):
        summary["limb"] = summarise_gaps(limbs)
    told: dict[str, Any] = {} if rig is None else {"rig": rig}
    if any(step.line.is_made for step in steps):
        told["operation"] = steps_to_json(steps)
    write_json(options.json, options.verb, {"frames": frames, "summary": summary, **told})
    if options.json != "-":
        diagnostics.say(summary_text(summary))
        if why := reasons_text(frames):
            diagnostics.say(why)
        if table := format_steps(steps):
            diagnostics.say(table)
        _say_what_was_written(options, diagnostics)
    if failure is not None:
        raise failure
    if summary["ok"] == 0:
        raise ResultError("no frame was OK", remedy="see the reasons in --json")
    return 0

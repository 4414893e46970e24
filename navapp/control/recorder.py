"""A session's folder: pictures and times by a frame sink, everything else here.

session.json   version, plan, options       rig.yml, prior.json, plan/
frames.csv     one line a frame              left_*.png, right_*.png
events.jsonl   commands, events and when a registration was taken over
poses.jsonl    poses and verdicts of every frame, version of the bone, what was measured
"""

import json
import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from queue import Queue
from typing import Any, Protocol, TextIO

from drivers.frames import StereoFrame
from navapp.control.command_files import command_to_json
from navapp.control.commands import Command
from navapp.control.disc_room import DiscRoom
from navapp.control.frame_result import FrameResult
from navapp.control.states import DeviceHealth, DeviceLine, Event, ToolReading
from navapp.errors import InputError, NavappError
from navapp.values import Measured, MeasuredHole, TrackedFrame

# Less room than for so many minutes is told as trouble.
_SHORT_MINUTES = 5.0


class FrameSink(Protocol):
    """Keeps frames."""

    def add(self, frame: StereoFrame, with_pictures: bool) -> None:
        """Keep one."""
        ...

    def close(self) -> None:
        """No more will come."""
        ...


class BackgroundSink:
    """Hands frames to a sink in a thread of its own: encoding pictures must not slow tracking.

    A full queue makes the caller wait: a recording with holes would not replay to the same poses.

    Raises:
        NavappError: what the sink raised, at the next call.
    """

    def __init__(self, sink: FrameSink, max_waiting: int = 8) -> None:
        self._sink = sink
        self._waiting: Queue[tuple[StereoFrame, bool] | None] = Queue(max_waiting)
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def add(self, frame: StereoFrame, with_pictures: bool) -> None:
        """Queue one; waits while the queue is full."""
        self._raise_error()
        self._waiting.put((frame, with_pictures))

    def close(self) -> None:
        """Wait until everything is kept."""
        self._waiting.put(None)
        self._thread.join()
        self._sink.close()
        self._raise_error()

    def _raise_error(self) -> None:
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _run(self) -> None:
        while (item := self._waiting.get()) is not None:
            if self._error is None:
                try:
                    self._sink.add(*item)
                except Exception as error:  # noqa: BLE001 (raised again in the caller's thread)
                    self._error = error


class RecordingStopped(InputError):  # noqa: N818 (an outcome for the session's events)
    """A session is no longer recorded; raised once, the session itself goes on."""


class SessionRecorder:
    """Listens to a controller and writes the session folder; every line is flushed.

    A folder that cannot be written any more (a full disk) ends the recording, not the session: the
    first failing call raises `RecordingStopped`, later ones do nothing.
    """

    def __init__(
        self,
        folder: Path,
        frames: FrameSink,
        *,
        with_pictures: bool = True,
        room: DiscRoom | None = None,
    ) -> None:
        """Begin.

        Args:
            folder: of the session.
            frames: keeps the frames.
            with_pictures: theirs as well.
            room: on the disc; None: nobody looks.
        """
        self._frames = frames
        self._room = room
        self._stopped = ""
        self._last_sequence = -1
        self._with_pictures = with_pictures
        self._events: TextIO = (folder / "events.jsonl").open("w", encoding="utf-8")
        self._poses: TextIO = (folder / "poses.jsonl").open("w", encoding="utf-8")

    @property
    def is_running(self) -> bool:
        """It has not been stopped."""
        return not self._stopped

    @property
    def line(self) -> DeviceLine | None:
        """For the devices panel; None where nobody looks at the disc."""
        if self._room is None:
            return None
        name, left = str(self._room.folder), self._room.left
        if self._stopped:
            return DeviceLine("recording", name, DeviceHealth.TROUBLE, self._stopped)
        is_short = left.minutes_left is not None and left.minutes_left < _SHORT_MINUTES
        health = DeviceHealth.TROUBLE if is_short else DeviceHealth.OK
        return DeviceLine("recording", name, health, left.words)

    def on_frame(self, result: FrameResult) -> None:
        """A frame was handled."""
        if self._room is not None:
            self._attempt(self._room.check)
        self._attempt(lambda: self._frames.add(result.frame, self._with_pictures))
        self._last_sequence = result.frame.sequence
        self._write(
            self._poses,
            {
                "sequence": result.frame.sequence,
                "bone": result.stage.bone,
                "state": result.state.value,
                "bone_version": result.bone_version,
                **_answer_to_json(result.tracked),
                "bodies": {
                    name: _answer_to_json(tracked) for name, tracked in result.others.items()
                },
                "measured": {name: measured_to_json(one) for name, one in result.measured.items()},
                "tools": {kind: reading_to_json(one) for kind, one in result.tools.items()},
            },
        )

    def on_command(self, command: Command, after_sequence: int) -> None:
        """A command is about to be handled."""
        self._write(
            self._events,
            {"type": "command", "sequence": after_sequence, **command_to_json(command)},
        )

    def on_take_over(self, before_sequence: int) -> None:
        """A registration's result is used from that frame on."""
        self._write(self._events, {"type": "take_over", "sequence": before_sequence})

    def on_other_take_over(self, sequence: int) -> None:
        """What a search for another bone has found is used in that frame."""
        self._write(self._events, {"type": "other_take_over", "sequence": sequence})

    def on_event(self, event: Event) -> None:
        """Something happened."""
        self._write(
            self._events,
            {
                "type": "event",
                "sequence": event.sequence,
                "time_ns": event.time_ns,
                "kind": event.kind,
                "level": event.level.value,
                "text": event.text,
            },
        )

    def close(self) -> None:
        """End the files; a recording that ran to its end says so in its last line."""
        with ExitStack() as closing:
            closing.callback(self._poses.close)
            closing.callback(self._events.close)
            self._attempt(self._frames.close)
            self._write(self._events, {"type": "end", "sequence": self._last_sequence})

    def _attempt(self, action: Callable[[], object]) -> None:
        if self._stopped:
            return
        try:
            action()
        except (OSError, NavappError) as error:
            self._stopped = f"recording stopped: {error}"
            raise RecordingStopped(self._stopped) from error

    def _write(self, stream: TextIO, value: dict[str, Any]) -> None:
        line = json.dumps(value) + "\n"
        self._attempt(lambda: (stream.write(line), stream.flush()))


def measured_to_json(measured: Measured) -> dict[str, Any]:
    """The face of a cut, or the mouth of a hole, in plan coordinates and against its plan."""
    if isinstance(measured, MeasuredHole):
        return {
            "entry_mm": measured.entry_mm.tolist(),
            "off_mm": measured.off_mm,
            "bound_mm": measured.bound_mm,
            "diameter_mm": measured.diameter_mm,
            "diameter_bound_mm": measured.diameter_bound_mm,
            "seen_share": measured.seen_share,
        }
    face = measured
    return {
        "point_mm": face.point_mm.tolist(),
        "normal": face.normal.tolist(),
        "angle_deg": face.angle_deg,
        "offset_mm": face.offset_mm,
        "bound_deg": face.bound_deg,
        "bound_mm": face.bound_mm,
        "seen_share": face.seen_share,
    }


def reading_to_json(reading: ToolReading) -> dict[str, Any]:
    """Where a tool is: in the left camera, and on the bone while that is OK."""
    seen, placed, hole = reading.seen, reading.placed, reading.hole
    found: dict[str, Any] = {
        "left_from_plate": seen.left_from_plate.to_list(),
        "tip_left_mm": seen.tip_mm.tolist(),
        "bound_left_mm": seen.tip_bound_mm,
        "seen_share": seen.seen_share,
    }
    if placed is None:
        return found
    found |= {
        "bone": placed.bone,
        "tip_mm": placed.tip_mm.tolist(),
        "axis": None if placed.axis is None else placed.axis.tolist(),
        "bound_mm": placed.bound_mm,
        "axis_bound_deg": placed.axis_bound_deg,
        "surface_mm": reading.surface_mm,
    }
    if hole is not None:
        found["hole"] = {
            "name": hole.name,
            "off_mm": hole.off_mm,
            "depth_mm": hole.depth_mm,
            "angle_deg": hole.angle_deg,
            "bound_deg": hole.bound_deg,
        }
    return found


def _answer_to_json(tracked: TrackedFrame | None) -> dict[str, Any]:
    """Status and pose of one bone."""
    pose = None if tracked is None else tracked.left_from_bone
    return {
        "status": None if tracked is None else tracked.verdict.status.value,
        "camera_from_model": None if pose is None else pose.to_list(),
    }

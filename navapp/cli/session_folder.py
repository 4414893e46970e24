"""A session's folder as `run --record` writes it and `replay` reads it."""

import json
from dataclasses import dataclass
from pathlib import Path

from drivers.session_files import SessionWriter
from navapp import __version__
from navapp.cli.sessions import prior_to_json, read_prior
from navapp.config import Configuration, as_toml
from navapp.control.operators import RecordedEvents, read_events
from navapp.control.recorder import BackgroundSink, SessionRecorder
from navapp.errors import SequenceError
from navapp.geometry.ply import write_whole
from navapp.geometry.rig import StereoRig, read_rig, write_rig
from navapp.preop import read_plan, write_plan
from navapp.values import Plan, Prior

_FILE = "session.json"


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSession:
    """What a session folder holds besides its frames."""

    rig: StereoRig
    plan: Plan
    prior: Prior
    method: str
    first_stage: str
    events: RecordedEvents


def start_recording(
    folder: str | Path,
    configuration: Configuration,
    rig: StereoRig,
    plan: Plan,
    prior: Prior,
    first_stage: str,
) -> SessionRecorder:
    """Make a session folder and a recorder into it.

    Raises:
        InputError: the folder holds a session already, or cannot be written.
    """
    folder = Path(folder)
    frames = SessionWriter(folder)
    write_rig(folder / "rig.yml", rig)
    write_plan(folder / "plan", plan)
    write_whole(folder / "prior.json", json.dumps(prior_to_json(prior), indent=1).encode())
    write_whole(folder / "configuration.toml", as_toml(configuration, False).encode())
    content = {
        "navapp": __version__,
        "rig_id": rig.rig_id,
        "plan_hash": plan.digest,
        "method": configuration.tracking.method,
        "first_stage": first_stage,
    }
    write_whole(folder / _FILE, json.dumps(content, indent=1).encode())
    return SessionRecorder(
        folder, BackgroundSink(frames), with_pictures=configuration.recording.pictures
    )


def is_session(folder: str | Path) -> bool:
    """Whether the folder was written by a recorder."""
    return (Path(folder) / _FILE).is_file()


def read_session(folder: str | Path) -> RecordedSession:
    """Read everything but the frames.

    Raises:
        InputError: damaged or half-written.
    """
    folder = Path(folder)
    try:
        content = json.loads((folder / _FILE).read_text(encoding="utf-8"))
        method, first_stage = str(content["method"]), str(content["first_stage"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SequenceError(
            f"session {folder} is damaged: {_FILE} cannot be understood",
            subject=str(folder),
            remedy="replay its pictures as a plain folder with --rig and --plan",
        ) from error
    events_path = folder / "events.jsonl"
    if not events_path.is_file():
        raise SequenceError(
            f"session {folder} has no events.jsonl",
            subject=str(folder),
            remedy="it was not recorded to its end",
        )
    return RecordedSession(
        read_rig(folder / "rig.yml"),
        read_plan(folder / "plan"),
        read_prior(folder / "prior.json"),
        method,
        first_stage,
        read_events(events_path),
    )

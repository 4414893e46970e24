"""A session's folder as `run --record` writes it and `replay` reads it."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from drivers.session_files import SessionWriter
from navapp import __version__
from navapp.config import Configuration, format_toml
from navapp.control.disc_room import DiscRoom, check_room_to_begin
from navapp.control.operators import RecordedEvents, read_events
from navapp.control.prior_files import prior_to_json
from navapp.control.recorder import BackgroundSink, SessionRecorder
from navapp.control.specification import SessionSpecification
from navapp.errors import SequenceError
from navapp.geometry.display_model_files import write_display_model
from navapp.geometry.rig_files import write_rig
from navapp.geometry.whole_files import write_whole
from navapp.preop import write_plan
from navapp.tools.tool_files import write_tool
from navapp.tracking import Method

_FILE = "session.json"
_RIG, _PLAN, _PRIOR, _DISPLAY = "rig.yml", "plan", "prior.json", "display.yml"
_METHODS: tuple[Method, ...] = get_args(Method)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSession:
    """What a session folder holds besides its frames: where its files are, and what they say."""

    rig_path: Path
    plan_path: Path
    prior_path: Path
    method: Method
    follows_refused: bool
    first_stage: str
    has_gates: bool
    check_minutes: float  # a check on the patient counted so long
    events: RecordedEvents
    others: tuple[str, ...] = ()  # bones that were looked for unasked
    # kind -> file of each tool that was looked for.
    tool_files: Mapping[str, str] = field(default_factory=dict)


def start_recording(
    folder: str | Path, configuration: Configuration, specification: SessionSpecification
) -> SessionRecorder:
    """Make a session folder and a recorder into it.

    Raises:
        InputError: the folder holds a session already, cannot be written, or has no room.
    """
    folder = Path(folder)
    with_pictures = configuration.recording.pictures
    if with_pictures:
        check_room_to_begin(folder)
    frames = SessionWriter(folder)
    rig, plan = specification.rig, specification.plan
    write_rig(folder / _RIG, rig)
    write_plan(folder / _PLAN, plan)
    prior = json.dumps(prior_to_json(specification.prior), indent=1)
    write_whole(folder / _PRIOR, prior.encode())
    if specification.display is not None:
        # The record keeps the display that was in force, whatever becomes of its file.
        path = folder.resolve() / _DISPLAY
        write_display_model(path, specification.display.model)
        kept = configuration.display.model_copy(update={"model": str(path)})
        configuration = configuration.model_copy(update={"display": kept})
    files: dict[str, str] = {}
    for kind, tool in specification.tools.items():
        files[kind] = str(folder.resolve() / f"{kind}.json")
        write_tool(files[kind], tool)
    if files:
        tools = configuration.tools.model_copy(update=files)
        configuration = configuration.model_copy(update={"tools": tools})
    write_whole(folder / "configuration.toml", format_toml(configuration, False).encode())
    content = {
        "navapp": __version__,
        "rig_id": rig.rig_id,
        "plan_hash": plan.digest,
        "method": specification.method,
        "follow_refused": specification.follows_refused,
        "first_stage": specification.stage.name,
        "gates": specification.has_gates,
        "check_minutes": specification.check_minutes,
        "others": list(specification.others),
        "tools": list(specification.tools),
    }
    write_whole(folder / _FILE, json.dumps(content, indent=1).encode())
    return SessionRecorder(
        folder,
        BackgroundSink(frames),
        with_pictures=with_pictures,
        room=DiscRoom(folder, lambda: frames.n_bytes),
    )


def discard_if_empty(folder: str | Path) -> None:
    """Remove a session folder in which no frame was kept, so that its name is free again."""
    folder = Path(folder)
    if is_session(folder) and not any(folder.glob("left_*")) and not _has_frames(folder):
        shutil.rmtree(folder, ignore_errors=True)


def _has_frames(folder: Path) -> bool:
    """Whether the table has a line beside its head (a session may be kept without pictures)."""
    table = folder / "frames.csv"
    return table.is_file() and len(table.read_text(encoding="utf-8").splitlines()) > 1


def is_session(folder: str | Path) -> bool:
    """Whether the folder was written by a recorder."""
    return (Path(folder) / _FILE).is_file()


def read_session(folder: str | Path) -> RecordedSession:
    """Read how a session was run; its rig, plan and prior are only named.

    Raises:
        InputError: damaged or half-written.
    """
    folder = Path(folder)
    try:
        content = json.loads((folder / _FILE).read_text(encoding="utf-8"))
        method, first_stage = str(content["method"]), str(content["first_stage"])
        check_minutes = float(content.get("check_minutes", 30.0))
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
        folder / _RIG,
        folder / _PLAN,
        folder / _PRIOR,
        _parse_method(method, folder),
        content.get("follow_refused") is True,
        first_stage,
        content.get("gates") is True,
        check_minutes,
        read_events(events_path),
        tuple(str(name) for name in content.get("others", ())),
        {str(kind): str(folder / f"{kind}.json") for kind in content.get("tools", ())},
    )


def _parse_method(name: str, folder: Path) -> Method:
    for method in _METHODS:
        if method == name:
            return method
    raise SequenceError(
        f"session {folder} was recorded with the unknown method '{name}'",
        subject=str(folder),
        remedy=f"use {' or '.join(_METHODS)} in its {_FILE}",
    )

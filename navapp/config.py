"""The TOML configuration: frozen models that refuse unknown keys and name the nearest known one."""

import datetime
import difflib
import json
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from navapp.errors import ConfigurationError

FILE_NAME = "navapp.toml"

Positive = Annotated[float, Field(gt=0.0)]


def _rising(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] >= values[1]:
        raise ValueError("the first must be smaller than the second")
    return values


M = TypeVar("M", bound=BaseModel)


class Section(BaseModel):
    """One table of the file."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )


class FaultSection(Section):
    """One scripted fault of the simulated camera; seconds since it was opened first."""

    kind: Literal[
        "unplug", "freeze", "drop", "delay", "blackout_left", "blackout_right", "wrong_serial"
    ]
    """What goes wrong."""
    start_s: Annotated[float, Field(ge=0.0)]
    """When it begins."""
    duration_s: Annotated[float, Field(gt=0.0, allow_inf_nan=True)]
    """How long it lasts; inf: for good."""
    delay_s: Annotated[float, Field(ge=0.0)] = 0.3
    """Of a delay: how much later frames come."""

    @model_validator(mode="after")
    def _has_its_own_keys(self) -> Self:
        if "delay_s" in self.model_fields_set and self.kind != "delay":
            raise ValueError(f"delay_s belongs to a delay, not to {self.kind}")
        return self


class SimulationSection(Section):
    """The simulated patient and rig."""

    seed: Annotated[int, Field(ge=0)] = 1
    """Of the anatomy, the textures, the placement and the motion."""
    side: Literal["left", "right"] = "right"
    """Of the knee."""
    sex: Literal["female", "male"] = "female"
    """Of the patient."""
    age_group: Literal["young", "middle", "old"] = "middle"
    """Of the patient."""
    cartilage_mm: Annotated[float, Field(ge=0.0, le=2.6)] = 0.0
    """Mean thickness of the cartilage that the camera sees and the plan does not; 0: bare bone."""
    motion: Literal["still", "breathing", "patient", "jump"] = "breathing"
    """Of the leg."""
    instrument: Literal["none", "sweep"] = "none"
    """What passes in front of the bone."""
    scale: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Size of the pictures: 1.0 is 1280 x 720."""
    stepped: bool | None = None
    """Whether frames wait to be read; by default in headless sessions only."""
    skew_ms: float = 0.0
    """The right camera exposes later by this."""
    grey: bool = False
    """Grey pictures, like those of an OAK camera."""
    faults: tuple[FaultSection, ...] = ()
    """Scripted faults: tables with kind, start_s, duration_s and, of a delay, delay_s."""


class CameraSection(BaseModel):
    """Where the pictures come from."""

    # Tables of third-party devices, [camera.NAME], are passed through unchecked.
    model_config = ConfigDict(
        frozen=True,
        extra="allow",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    backend: str = "simulated"
    """simulated, or the name of an installed device."""
    rig: str | None = None
    """Rig file (OpenCV YAML); simulated cameras bring their own."""
    rate_hz: Positive = 15.0
    """Pairs per second asked for, or assumed where a recording has no times."""
    depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(_rising)] = (300.0, 700.0)
    """Nearest and farthest surface that the rig is used for."""
    simulated: SimulationSection = SimulationSection()
    """The simulated patient and rig."""


class DisplaySection(Section):
    """Where the overlay is shown."""

    backend: Literal["simulated"] = "simulated"
    """simulated."""
    valid_ms: Positive = 500.0
    """A picture without a newer one turns black after this."""


class ProjectorSection(Section):
    """The projector's control line."""

    backend: Literal["none"] = "none"
    """none."""


class MirrorSection(Section):
    """The mount of the half-silvered mirror."""

    backend: Literal["fixed"] = "fixed"
    """fixed."""
    calibrated_deg: float = 45.0
    """Angle at which the display was calibrated."""


class PlanSection(Section):
    """The pre-operative plan."""

    path: str | None = None
    """Plan folder; the simulated rig brings its own."""
    prior: str | None = None
    """JSON file with the rough start pose."""


class TrackingSection(Section):
    """The line."""

    method: Literal["bimcc", "icp"] = "bimcc"
    """icp is the paper's baseline."""


class CalibrationSection(Section):
    """Calibration of the stereo rig."""

    stop_capture_mm: Positive = 0.15
    """A capture may end when half of the working volume has a predicted 95 % error below."""
    accept_mm: Positive = 0.40
    """A rig is accepted when nearly all of the working volume has a predicted 95 % error below."""
    working_depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(_rising)] = (350.0, 550.0)
    """Nearest and farthest surface of the working volume."""
    valid_days: Annotated[int, Field(gt=0)] = 180
    """A rig is refused when it is older."""


class StagesSection(Section):
    """The surgical stages."""

    first: str = "opening"
    """Name or number of the stage that a session starts in."""


class RecordingSection(Section):
    """Session folders."""

    folder: str | None = None
    """Record every session into this new folder."""
    pictures: bool = True
    """Keep the raw pairs (lossless PNG), so that the session can be replayed."""


class EmptySection(Section):
    """A table without keys."""


class Configuration(Section):
    """The whole file."""

    camera: CameraSection = CameraSection()
    display: DisplaySection = DisplaySection()
    projector: ProjectorSection = ProjectorSection()
    mirror: MirrorSection = MirrorSection()
    plan: PlanSection = PlanSection()
    stereo: EmptySection = EmptySection()
    registration: EmptySection = EmptySection()
    tracking: TrackingSection = TrackingSection()
    calibration: CalibrationSection = CalibrationSection()
    overlay: EmptySection = EmptySection()
    stages: StagesSection = StagesSection()
    recording: RecordingSection = RecordingSection()
    link: EmptySection = EmptySection()
    ui: EmptySection = EmptySection()


def find_file(given: str | Path | None) -> Path | None:
    """The file to read: the one given, ./navapp.toml, or the user's; None when there is none.

    Raises:
        ConfigurationError: the file given does not exist.
    """
    if given is not None:
        if not Path(given).is_file():
            raise ConfigurationError(
                f"configuration file {given} does not exist",
                subject=str(given),
                remedy="write one with `navapp config init`",
            )
        return Path(given)
    import platformdirs

    for candidate in (
        Path(FILE_NAME),
        Path(platformdirs.user_config_dir("navapp", appauthor=False)) / FILE_NAME,
    ):
        if candidate.is_file() and os.access(candidate, os.R_OK):
            return candidate
    return None


def load(path: Path | None) -> Configuration:
    """Read a file; defaults when there is none.

    Raises:
        ConfigurationError: broken TOML, unknown key, wrong type, out of bounds.
    """
    if path is None:
        return Configuration()
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(
            f"configuration file {path} cannot be read", subject=str(path), remedy=str(error)
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(
            f"configuration file {path} is not valid TOML",
            subject=str(path),
            remedy=f"mend it: {error}",
        ) from error
    return parse(content, str(path))


def parse(content: Mapping[str, Any], name: str) -> Configuration:
    """Check the content of a configuration file."""
    configuration = checked(Configuration, content, name)
    for key, value in (configuration.camera.model_extra or {}).items():
        if not isinstance(value, Mapping):
            raise _unknown_key(Configuration, ["camera", key], name)
    return configuration


def checked(model: type[M], content: Mapping[str, Any], name: str) -> M:
    """What a TOML file holds, as a model.

    Raises:
        ConfigurationError: one sentence with the file's name, the key and the nearest known key.
    """
    try:
        return model.model_validate(_tuples(content))
    except ValidationError as error:
        raise _one_sentence(model, error, name) from error


def _tuples(value: Any) -> Any:
    """Lists as tuples: TOML has the former, the frozen models the latter."""
    if isinstance(value, Mapping):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def _one_sentence(model: type[BaseModel], error: ValidationError, name: str) -> ConfigurationError:
    """The first problem, with the key's path and, for a typing error, the nearest known key."""
    problem = error.errors()[0]
    path = [str(part) for part in problem["loc"]]
    key = ".".join(path)
    if problem["type"] != "extra_forbidden":
        return ConfigurationError(
            f"{name}: {key}: {problem['msg'].lower()}", subject=key, remedy="correct the value"
        )
    return _unknown_key(model, path, name)


def _unknown_key(model: type[BaseModel], path: list[str], name: str) -> ConfigurationError:
    key = ".".join(path)
    known = _known_keys(model, path[:-1])
    near = difflib.get_close_matches(path[-1], known, 1)
    remedy = (
        f"did you mean '{near[0]}'?" if near else f"known here: {', '.join(known) or 'nothing'}"
    )
    return ConfigurationError(f"{name}: unknown key '{key}'", subject=key, remedy=remedy)


def _known_keys(model: type[BaseModel], path: list[str]) -> list[str]:
    for part in path:
        if part.isdigit():  # the place in a list of tables
            continue
        field = model.model_fields.get(part)
        inner = None if field is None else _model_in(field.annotation)
        if inner is None:
            return []
        model = inner
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model that a key holds, itself or in a list."""
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def as_toml(configuration: Configuration, with_comments: bool) -> str:
    """The configuration as a TOML file; with comments it is a file to start from."""
    lines = ["# navapp configuration: research software, not for clinical use", ""]
    for name in Configuration.model_fields:
        section = getattr(configuration, name)
        lines += _table(name, type(section), section, with_comments)
    return "\n".join(lines).rstrip() + "\n"


def _table(name: str, model: type[BaseModel], values: BaseModel, with_comments: bool) -> list[str]:
    lines = [f"[{name}]"]
    inner: list[str] = []
    for key, field in model.model_fields.items():
        value = getattr(values, key)
        if isinstance(value, BaseModel):
            inner += _table(f"{name}.{key}", type(value), value, with_comments)
            continue
        if with_comments and field.description:
            lines.append(f"# {field.description}")
        # A key without a value is shown, but commented out: TOML has no null.
        lines.append(f"# {key} =" if value is None else f"{key} = {_literal(value)}")
    for key, value in (values.model_extra or {}).items():
        if isinstance(value, Mapping):
            entries = [f"{_key(k)} = {_literal(v)}" for k, v in value.items()]
            inner += [f"[{name}.{_key(key)}]", *entries, ""]
    return [*lines, "", *inner]


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # TOML's escapes are JSON's, except that it wants one for DEL, too.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_literal(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_literal(item) for item in value) + "]"
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    return repr(value)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _literal(name)

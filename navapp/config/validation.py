"""Validates a file's content; an error is one sentence with the key and the nearest known one."""

import difflib
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from navapp.config.sections import Configuration
from navapp.errors import ConfigurationError

M = TypeVar("M", bound=BaseModel)


def parse(content: Mapping[str, Any], name: str) -> Configuration:
    """Check the content of a configuration file."""
    configuration = validate(Configuration, content, name)
    for key, value in (configuration.camera.model_extra or {}).items():
        if not isinstance(value, Mapping):
            raise _unknown_key(Configuration, ["camera", key], name)
    return configuration


def validate(model: type[M], content: Mapping[str, Any], name: str) -> M:
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
    """The first problem, with the key's path and, for a typing error, the nearest known key.

    A key that is misspelt is also one that is missing: its own name comes first.
    """
    problems = error.errors()
    problem = next((one for one in problems if one["type"] == "extra_forbidden"), problems[0])
    path = [str(part) for part in problem["loc"]]
    key = ".".join(path)
    if problem["type"] != "extra_forbidden":
        what = problem["msg"].lower().removeprefix("value error, ")
        remedy = "add it" if problem["type"] == "missing" else "correct the value"
        return ConfigurationError(f"{name}: {key}: {what}", subject=key, remedy=remedy)
    return _unknown_key(model, path, name)


def _unknown_key(model: type[BaseModel], path: list[str], name: str) -> ConfigurationError:
    key = ".".join(path)
    known = _list_known_keys(model, path[:-1])
    near = difflib.get_close_matches(path[-1], known, 1)
    remedy = (
        f"did you mean '{near[0]}'?" if near else f"known here: {', '.join(known) or 'nothing'}"
    )
    return ConfigurationError(f"{name}: unknown key '{key}'", subject=key, remedy=remedy)


def _list_known_keys(model: type[BaseModel], path: list[str]) -> list[str]:
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

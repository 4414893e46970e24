"""The configuration as TOML text."""

import datetime
import json
import re
import textwrap
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from navapp.config.sections import Configuration
from navapp.config.value_words import describe_values


def format_toml(configuration: Configuration, with_comments: bool) -> str:
    """The configuration as a TOML file; with comments it is a file to start from."""
    lines = ["# navapp configuration: research software, not for clinical use", ""]
    for name in Configuration.model_fields:
        section = getattr(configuration, name)
        lines += _table(name, type(section), section, with_comments)
    return "\n".join(lines).rstrip() + "\n"


def format_table(name: str, values: Mapping[str, Any]) -> str:
    """A table with some keys: what a person adds to a file."""
    return "\n".join([f"[{name}]", *(f"{_key(k)} = {_literal(v)}" for k, v in values.items())])


def _table(name: str, model: type[BaseModel], values: BaseModel, with_comments: bool) -> list[str]:
    lines = [f"[{name}]"]
    inner: list[str] = []
    may_hold = describe_values(model) if with_comments else {}
    for key, field in model.model_fields.items():
        value = getattr(values, key)
        if isinstance(value, BaseModel):
            inner += _table(f"{name}.{key}", type(value), value, with_comments)
            continue
        if with_comments:
            lines += _comment(field.description or "", may_hold[key], field.get_default())
        # A key without a value is shown, but commented out: TOML has no null.
        lines.append(f"# {key} =" if value is None else f"{key} = {_literal(value)}")
    for key, value in (values.model_extra or {}).items():
        if isinstance(value, Mapping):
            inner += [format_table(f"{name}.{_key(key)}", value), ""]
    return [*lines, "", *inner]


def _comment(meaning: str, may_hold: str, default: Any) -> list[str]:
    """What a key means, what it may hold, and its default."""
    usual = "left out" if default is None else _literal(default)
    values = textwrap.wrap(f"values: {may_hold}; default: {usual}", 96, subsequent_indent="  ")
    return [f"# {line}" for line in (*([meaning] if meaning else []), *values)]


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

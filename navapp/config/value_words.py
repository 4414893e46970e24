"""What a key of the configuration may hold, in words, made from the schema of its table."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

_UNITS = {
    "mm": "mm", "ms": "ms", "s": "s", "hz": "Hz", "px": "px", "deg": "degrees", "days": "days",
    "minutes": "minutes", "k": "kelvin", "mm_s": "mm/s",
}  # fmt: skip
_TYPES = {"string": "text", "integer": "whole number", "number": "number"}


def describe_values(model: type[BaseModel]) -> dict[str, str]:
    """Key -> what it may hold, of every key of a table that is no table itself."""
    schema = model.model_json_schema()
    tables = schema.get("$defs", {})
    return {
        key: _describe_key(key, one, tables)
        for key, one in schema.get("properties", {}).items()
        if "$ref" not in one
    }


def _describe_key(key: str, schema: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    """Type, range and unit."""
    kinds = [one for one in schema.get("anyOf", [schema]) if one.get("type") != "null"]
    words = " or ".join(_describe(one, tables) for one in kinds)
    # The longest first: mm_s is no time.
    ends = sorted((end for end in _UNITS if key.endswith(f"_{end}")), key=len)
    return f"{words}, in {_UNITS[ends[-1]]}" if ends else words


def _describe(schema: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    if "$ref" in schema:
        return _describe_table(tables[schema["$ref"].rpartition("/")[2]], tables)
    if "enum" in schema:
        return "one of " + ", ".join(f'"{value}"' for value in schema["enum"])
    if schema["type"] == "boolean":
        return "true or false"
    if schema["type"] == "array":
        return _describe_list(schema, tables)
    return _TYPES[schema["type"]] + _describe_range(schema)


def _describe_list(schema: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    if "items" in schema:
        return f"list of {_describe(schema['items'], tables)}"
    items = schema["prefixItems"]
    kinds = list(dict.fromkeys(_describe(item, tables) for item in items))
    return f"[{', '.join('.' * 3 for _ in items)}], each a {' or a '.join(kinds)}"


def _describe_table(schema: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    needed = schema.get("required", [])
    keys = [
        f"{key} ({_describe_key(key, one, tables)}{', needed' if key in needed else ''})"
        for key, one in schema["properties"].items()
    ]
    return f"tables {{ ... }} with {'; '.join(keys)}"


def _describe_range(schema: Mapping[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    if schema["type"] == "string":
        low, high = schema.get("minLength"), schema.get("maxLength")
        return f" of {low} characters" if low is not None and low == high else ""
    if low is not None and high is not None:
        return f" from {low:g} to {high:g}"
    words = (
        ("exclusiveMinimum", "above"),
        ("minimum", "of at least"),
        ("exclusiveMaximum", "below"),
        ("maximum", "of at most"),
    )
    found = [f"{word} {schema[key]:g}" for key, word in words if key in schema]
    return "".join(f" {one}" for one in [" and ".join(found)] if one)

"""Finds and reads the configuration file."""

import os
import tomllib
from pathlib import Path
from typing import Any

from navapp.config.sections import Configuration
from navapp.config.validation import parse
from navapp.errors import ConfigurationError

FILE_NAME = "navapp.toml"


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
    return parse(read_toml(path, "configuration file"), str(path))


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """What a TOML file holds; `what` it is, for messages.

    Raises:
        ConfigurationError: it cannot be read, or is broken.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(
            f"{what} {path} cannot be read", subject=str(path), remedy=str(error)
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(
            f"{what} {path} is not valid TOML", subject=str(path), remedy=f"mend it: {error}"
        ) from error

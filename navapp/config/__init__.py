"""The TOML configuration; what is wrong with it is told with the nearest known key."""

from navapp.config.camera_sections import FaultSection, SimulationSection
from navapp.config.files import FILE_NAME, find_file, load, read_toml
from navapp.config.section import Section
from navapp.config.sections import (
    CalibrationSection,
    Configuration,
    DisplaySection,
    MirrorSection,
    ProjectorSection,
)
from navapp.config.toml_text import format_table, format_toml
from navapp.config.validation import parse, validate

__all__ = [
    "FILE_NAME",
    "CalibrationSection",
    "Configuration",
    "DisplaySection",
    "FaultSection",
    "MirrorSection",
    "ProjectorSection",
    "Section",
    "SimulationSection",
    "find_file",
    "format_table",
    "format_toml",
    "load",
    "parse",
    "read_toml",
    "validate",
]

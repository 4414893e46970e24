"""Before the operation: surfaces and targets become a plan."""

from navapp.preop.aspect_files import read_aspects, write_aspects
from navapp.preop.aspects import AspectSettings, build_aspects
from navapp.preop.plan_files import read_plan, write_plan
from navapp.preop.surfaces import ImportedSurface, import_surface

__all__ = [
    "AspectSettings",
    "ImportedSurface",
    "build_aspects",
    "import_surface",
    "read_aspects",
    "read_plan",
    "write_aspects",
    "write_plan",
]

"""Planning: makes plans from a CT, a segmentation or surfaces, and reads and writes them."""

from navapp.preop.aspect_files import read_aspects, write_aspects
from navapp.preop.aspects import AspectSettings, build_aspects
from navapp.preop.cartilage import figures_of, import_cartilage, make_even_cartilage
from navapp.preop.plan_completion import complete, with_side
from navapp.preop.plan_files import read_origin, read_plan, read_plan_view, write_plan
from navapp.preop.plan_origin import PlanOrigin
from navapp.preop.plan_place import check_place
from navapp.preop.plan_view import PlanView, make_plan_view
from navapp.preop.surface_import import ImportedSurface, import_surface

__all__ = [
    "AspectSettings",
    "ImportedSurface",
    "PlanOrigin",
    "PlanView",
    "build_aspects",
    "check_place",
    "complete",
    "figures_of",
    "import_cartilage",
    "import_surface",
    "make_even_cartilage",
    "make_plan_view",
    "read_aspects",
    "read_origin",
    "read_plan",
    "read_plan_view",
    "with_side",
    "write_aspects",
    "write_plan",
]

"""Before the operation: surfaces and targets become a plan."""

from navapp.preop.cartilage import even_cartilage, figures_of, import_cartilage
from navapp.preop.plan_files import read_plan, write_plan
from navapp.preop.surfaces import ImportedSurface, import_surface

__all__ = [
    "ImportedSurface",
    "even_cartilage",
    "figures_of",
    "import_cartilage",
    "import_surface",
    "read_plan",
    "write_plan",
]

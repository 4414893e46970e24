"""navapp: markerless surgical navigation for knee replacement, for research."""

from navapp import environment as _environment

__version__ = "0.1.0"

_environment.prepare()

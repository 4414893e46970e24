"""The methods that are compared: ours, the paper's two, and ours without one of its parts."""

from typing import Final

from navapp.tracking import Method, Part

OURS: Final = "bimcc"
WITHOUT_FILL: Final = "without filled depth"
# As the paper's tables have them: its state of the art, its proposal; then ours.
METHODS: tuple[Method, ...] = ("icp", "paper", "bimcc")
# Ours whole, and without one part at a time.
VARIANTS: dict[str, frozenset[Part]] = {
    OURS: frozenset(),
    WITHOUT_FILL: frozenset({"fill"}),
    "without bidirectional pairs": frozenset({"backward pairs"}),
    "without contour": frozenset({"contour"}),
    "without second look": frozenset({"second look"}),
    "without judge": frozenset({"judge"}),
}


def find_method(name: str) -> tuple[Method, frozenset[Part]]:
    """The method of that name, and the parts of it that are left out.

    Raises:
        KeyError: there is none.
    """
    for method in METHODS:
        if name == method:
            return method, frozenset()
    return OURS, VARIANTS[name]

"""Which layers of the overlay are drawn."""

from navapp.overlay import LAYERS
from navapp.values import StageSpec


class LayerChoice:
    """The layers of the stage in force, but for what the operator has switched there.

    Args:
        only: drawn in every stage; None: the stage's own.
    """

    def __init__(self, only: tuple[str, ...] | None = None) -> None:
        self._only = only
        self._switched: frozenset[str] = frozenset()

    def of(self, stage: StageSpec) -> tuple[str, ...]:
        """Names of the layers drawn."""
        drawn = stage.layers if self._only is None else self._only
        return tuple(name for name in LAYERS if (name in drawn) != (name in self._switched))

    def toggle(self, name: str) -> None:
        """Draw a layer, or no longer, until the stage is left."""
        self._switched ^= {name}

    def reset(self) -> None:
        """Another stage begins with its own layers."""
        self._switched = frozenset()

"""Where a person is among the slices of a plan."""

import numpy as np

from navapp.preop import PlanView
from navapp.preop.slice_drawing import WINDOWS_HU
from navapp.preop.slices import DIRECTIONS, Direction

_WINDOWS = tuple(WINDOWS_HU)


class SliceWalk:
    """A direction, a slice of each direction, and what is shown as black and white.

    Args:
        plan: whose slices they are; the walk begins in the middle of its first bone.

    Attributes:
        plan: as given.
        direction: of the slice that is shown.
        window: name of what is shown from black to white.
    """

    def __init__(self, plan: PlanView) -> None:
        self.plan = plan
        self.direction: Direction = DIRECTIONS[0]
        self.window = _WINDOWS[0]
        vertices_mm = next(iter(plan.plan.bones.values())).mesh.vertices_mm
        middle_mm = 0.5 * (vertices_mm.min(axis=0) + vertices_mm.max(axis=0))
        self._indices = {}
        for direction in DIRECTIONS:
            (index,) = plan.grid.find_slices(direction, middle_mm[None]).tolist()
            self._indices[direction.name] = self._keep_inside(direction, index)

    @property
    def index(self) -> int:
        """Of the slice that is shown."""
        return self._indices[self.direction.name]

    @property
    def window_hu(self) -> tuple[float, float] | None:
        """What is shown as black and as white; None for all that is stored."""
        return WINDOWS_HU[self.window]

    def scroll(self, step: int) -> None:
        """To another slice of the same direction; it ends at the first and the last."""
        self._go_to(self.index + step)

    def choose(self, number: int) -> None:
        """A direction, by its number from 1."""
        self.direction = DIRECTIONS[number - 1]

    def turn(self, step: int) -> None:
        """The next direction, or the one before."""
        number = (DIRECTIONS.index(self.direction) + step) % len(DIRECTIONS)
        self.direction = DIRECTIONS[number]

    def go_to_point(self, step: int) -> bool:
        """The next slice with a landmark or a target, or the one before; after the last the first.

        Returns:
            Whether there is one.
        """
        found = self.plan.list_pointed(self.direction)
        if not len(found):
            return False
        place = int(np.searchsorted(found, self.index, side="right" if step > 0 else "left"))
        self._go_to(int(found[(place if step > 0 else place - 1) % len(found)]))
        return True

    def change_window(self) -> None:
        """Other densities become black and white."""
        self.window = _WINDOWS[(_WINDOWS.index(self.window) + 1) % len(_WINDOWS)]

    def _go_to(self, index: int) -> None:
        self._indices[self.direction.name] = self._keep_inside(self.direction, index)

    def _keep_inside(self, direction: Direction, index: int) -> int:
        return min(max(index, 0), self.plan.grid.count_slices(direction) - 1)

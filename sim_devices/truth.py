"""True poses of the simulated world, for judging results only."""

from collections.abc import Callable
from typing import Protocol

from navapp.geometry.transform import RigidTransform


class KnowsPoses(Protocol):
    """The part of a world that knows where its bodies are."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names."""
        ...

    def left_from_body(self, body: str, time_ns: int) -> RigidTransform:
        """Pose in the left camera at a world time (0 = start)."""
        ...


class TruthOracle:
    """True poses at the capture times of frames.

    Kept apart from every device: no stage of the line may ever be handed one.
    """

    def __init__(self, world: KnowsPoses, world_time_of: Callable[[int], int]) -> None:
        """Join a world and the clock of its camera.

        Args:
            world: knows the poses.
            world_time_of: world time in ns of a capture time in ns.
        """
        self._world = world
        self._world_time_of = world_time_of

    @property
    def bodies(self) -> tuple[str, ...]:
        """Whose poses are known."""
        return self._world.bodies

    def left_from_body(self, body: str, captured_ns: int) -> RigidTransform:
        """True pose of a body in the left camera (not rectified, mm) when a frame was captured."""
        return self._world.left_from_body(body, self._world_time_of(captured_ns))

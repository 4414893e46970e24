"""The truth of the simulated world, for judging results only."""

from collections.abc import Callable
from typing import Protocol

from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.operation_record import OperationRecord


class KnowsTruth(Protocol):
    """The part of a world that knows where its bodies are, and what was made of them."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names."""
        ...

    def left_from_body(self, body: str, time_ns: int) -> RigidTransform:
        """Pose in the left camera at a world time (0 = start)."""
        ...

    def seen_ns(self, body: str, time_ns: int) -> int:
        """World time at which the body's own rows of a picture of that time are exposed."""
        ...

    @property
    def record(self) -> OperationRecord:
        """What was really made."""
        ...


class TruthOracle:
    """True poses at the capture times of frames, and what saw and drill really made.

    Kept apart from every device: no stage of the line may ever be handed one.
    """

    def __init__(self, world: KnowsTruth, world_time_of: Callable[[int], int]) -> None:
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
        """True pose of a body in the left camera (not rectified, mm) when a frame was captured.

        That is mid exposure of the picture's middle row.
        """
        return self._world.left_from_body(body, self._world_time_of(captured_ns))

    def left_from_seen_body(self, body: str, captured_ns: int) -> RigidTransform:
        """True pose of a body when the frame's left picture showed it: what an answer is judged by.

        That is mid exposure of the middle row of the body's box in the left picture. Without a
        rolling shutter it is the pose at capture.
        """
        time_ns = self._world_time_of(captured_ns)
        return self._world.left_from_body(body, self._world.seen_ns(body, time_ns))

    def made_planes(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Faces that the saw leaves, made already or not, by the name of their planned cut.

        Point (3,) mm and unit normal (3,) out of the bone, in the coordinates of its model.
        """
        return self._world.record.made_planes

    def made_hole(self) -> tuple[FloatArray, FloatArray]:
        """Where the drilled hole enters the femur (3,) mm, and its unit direction (3,)."""
        return self._world.record.made_hole

    def made_parts(self) -> dict[str, RigidTransform]:
        """By which motion, in the coordinates of its bone, each component is off its plan."""
        return self._world.record.made_parts

    def made_insert(self) -> float:
        """Thickness (mm) of the insert with its tray: it sets the gap of the finished knee."""
        return self._world.record.made_insert_mm

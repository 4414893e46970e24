"""The smallest world: two cameras in front of a grey ramp that moves, and one body."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from sim_devices.rigs import NO_TURN, Turn


def plain_rig(width: int = 64, height: int = 48) -> StereoRig:
    matrix = np.array([[80.0, 0, (width - 1) / 2], [0, 80.0, (height - 1) / 2], [0, 0, 1]])
    camera = Camera(matrix, np.zeros(0), width, height)
    shift = RigidTransform.from_parts("right", "left", np.eye(3), (-60.0, 0.0, 0.0))
    return StereoRig(camera, camera, shift, ("L1", "R1"))


class PlainWorld:
    """Brightness grows with time, so that a picture tells when it was taken."""

    def __init__(self, width: int = 64, height: int = 48) -> None:
        self.rig = plain_rig(width, height)
        self.bodies = ("femur",)
        self.speed_px_s = 0.0  # of what `path_px` tells; the picture knows nothing of it
        self.rendered: list[tuple[str, int]] = []
        self.turns_rad: list[Turn] = []

    def left_from_body(self, body: str, time_ns: int) -> RigidTransform:
        return RigidTransform.from_parts(
            "left", body, np.eye(3), (0.0, 0.0, 400.0 + time_ns * 1e-9)
        )

    def seen_ns(self, body: str, time_ns: int) -> int:
        return time_ns

    def path_px(self, from_ns: int, until_ns: int) -> float:
        return self.speed_px_s * (until_ns - from_ns) * 1e-9

    def render(
        self,
        eye: str,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: tuple[int, int] | None = None,
    ) -> NDArray[np.float32]:
        self.rendered.append((eye, time_ns))
        self.turns_rad.append(turn_rad)
        rig = self.rig.scale(scale)
        level = 0.1 + 0.2 * (time_ns * 1e-9 % 4.0)
        ramp = np.linspace(0.0, 0.1, rig.width, dtype=np.float32) + np.float32(level)
        return np.broadcast_to(ramp[None, :, None], (rig.height, rig.width, 3)).astype(np.float32)

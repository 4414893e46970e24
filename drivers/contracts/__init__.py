"""The contract of each kind of device, as functions that any backend can be put through.

A check is a function of a maker: it makes as many fresh devices as it needs and raises
`ContractViolation` with a sentence when one of them breaks the contract. Nothing here needs a test
runner:

    from drivers.contracts import CAMERA_CHECKS, CameraUnderTest

    def make() -> CameraUnderTest:
        clock = SystemClock()
        return CameraUnderTest(AcmeCamera({}, clock), clock)

    for check in CAMERA_CHECKS:
        check(make)
"""

from drivers.contracts.camera import CAMERA_CHECKS, CameraUnderTest
from drivers.contracts.clock import CLOCK_CHECKS
from drivers.contracts.display import DISPLAY_CHECKS, DisplayUnderTest
from drivers.contracts.mirror import MIRROR_CHECKS, MirrorUnderTest
from drivers.contracts.projector import PROJECTOR_CHECKS, ProjectorUnderTest
from drivers.contracts.violation import ContractViolation

__all__ = [
    "CAMERA_CHECKS",
    "CLOCK_CHECKS",
    "DISPLAY_CHECKS",
    "MIRROR_CHECKS",
    "PROJECTOR_CHECKS",
    "CameraUnderTest",
    "ContractViolation",
    "DisplayUnderTest",
    "MirrorUnderTest",
    "ProjectorUnderTest",
]

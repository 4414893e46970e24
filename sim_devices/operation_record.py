"""What is planned for a knee and what is made of it, in the coordinates of its own side."""

from dataclasses import replace

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.anatomy import MIRROR, mirror_mesh
from sim_devices.fitted_parts import SEATS, FittedParts
from sim_devices.layout import mirror_pose
from sim_devices.planned_cuts import Cut
from sim_devices.site import Site


class OperationRecord:
    """The whole operation of one patient, whatever has been made by now. `made_*` is truth.

    Args:
        site: of a right knee.
        fitted: its components.
        is_left: whether the patient's knee is the mirror image of that.
    """

    def __init__(self, site: Site, fitted: FittedParts, *, is_left: bool) -> None:
        self._site, self._fitted, self._is_left = site, fitted, is_left
        self._sides = MIRROR if is_left else np.ones(3)

    @property
    def planned_cuts(self) -> dict[str, Cut]:
        """All cuts, by name."""
        return {name: self._on_side(cut) for name, cut in self._site.planned.items()}

    @property
    def planned_parts(self) -> dict[str, TriangleMesh]:
        """All components where they are planned, by name."""
        planned = self._fitted.planned.items()
        return {name: mirror_mesh(mesh) if self._is_left else mesh for name, mesh in planned}

    @property
    def planned_hole(self) -> tuple[FloatArray, FloatArray]:
        """Where the drill is to enter the femur, and its unit direction, (3,) each."""
        entry_mm, axis = self._site.planned_hole
        return entry_mm * self._sides, axis * self._sides

    @property
    def made_hole(self) -> tuple[FloatArray, FloatArray]:
        """Where the drill really enters it, and its unit direction, (3,) each."""
        entry_mm, axis = self._site.made_hole
        return entry_mm * self._sides, axis * self._sides

    @property
    def made_planes(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Point and unit normal, (3,) each, of the faces that the saw leaves, by name."""
        cuts = {name: self._on_side(cut) for name, cut in self._site.made.items()}
        return {name: (cut.point_mm, cut.normal) for name, cut in cuts.items()}

    @property
    def made_parts(self) -> dict[str, RigidTransform]:
        """By which motion, in its bone's coordinates, each component is off its plan."""
        motions = {name: self._fitted.motion_from_plan(name) for name in SEATS}
        return {
            name: mirror_pose(motion) if self._is_left else motion
            for name, motion in motions.items()
        }

    @property
    def made_insert_mm(self) -> float:
        """Thickness of the insert with its tray."""
        return self._fitted.insert_mm

    def _on_side(self, cut: Cut) -> Cut:
        return replace(cut, point_mm=cut.point_mm * self._sides, normal=cut.normal * self._sides)

"""The components as they are fitted to the bones that were sawn, and how the knee then closes."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from sim_devices.anatomy import KneeSpec
from sim_devices.components import (
    PLAN_CELL_MM,
    make_femoral_component,
    make_patellar_button,
    make_tray_and_insert,
)
from sim_devices.layout import slide_tibia
from sim_devices.planned_cuts import RESECTION_MM, Cut
from sim_devices.sawn_bone import cut_skin
from sim_devices.site import Site
from sim_devices.tools import merge_meshes

# The cut on whose face a component sits: where the saw missed, the component is off its plan, too.
SEATS = {
    "femoral_implant": "femur_distal",
    "patellar_implant": "patella",
    "spacer": "tibia_proximal",
}
# What a surgeon chooses from: thickness of tray and insert together.
INSERTS_MM = np.arange(5.0, 16.5, 0.5)
_CONTACT_MM = 0.3
# A plan's components by the knee that they are planned for, which says all of them.
_KEPT_KNEES = 16
_planned_of: dict[KneeSpec, dict[str, TriangleMesh]] = {}


class FittedParts:
    """The components of one operation; each is made when it is asked for first.

    Args:
        site: of the operation.
    """

    def __init__(self, site: Site) -> None:
        self._site = site

    def motion_from_plan(self, part: str) -> RigidTransform:
        """By which motion, in the coordinates of its bone, a component is off its plan."""
        planned, made = (cuts[SEATS[part]] for cuts in (self._site.planned, self._site.made))
        axes_made, axes_planned = (np.stack([*cut.axes, cut.normal]) for cut in (made, planned))
        rotation = axes_made.T @ axes_planned
        origin = made.point_mm - rotation @ planned.point_mm
        return RigidTransform.from_parts(planned.bone, planned.bone, rotation, origin)

    @cached_property
    def rasped(self) -> tuple[Cut, ...]:
        """What the femur loses on top of its cuts until the component sits on the distal one."""
        motion = self.motion_from_plan("femoral_implant")
        return tuple(
            replace(cut, point_mm=motion.apply(cut.point_mm), normal=motion.rotate(cut.normal))
            for cut in self._site.planned.values()
            if cut.bone == "femur"
        )

    @cached_property
    def planned(self) -> dict[str, TriangleMesh]:
        """The components as a plan holds them: on the planned cuts, as thick as those take off."""
        spec = self._site.knee.spec
        if spec not in _planned_of:
            if len(_planned_of) >= _KEPT_KNEES:
                _planned_of.clear()
            _planned_of[spec] = self._make_planned()
        return dict(_planned_of[spec])

    def _make_planned(self) -> dict[str, TriangleMesh]:
        knee, cuts = self._site.knee, self._site.planned
        femoral = make_femoral_component(knee, self._femoral_cuts, PLAN_CELL_MM)
        spacer = make_tray_and_insert(knee, cuts["tibia_proximal"], RESECTION_MM, PLAN_CELL_MM)
        return {
            "femoral_implant": femoral,
            "patellar_implant": make_patellar_button(knee, cuts["patella"]),
            "spacer": merge_meshes(list(spacer)),
        }

    @property
    def _femoral_cuts(self) -> list[Cut]:
        return [cut for cut in self._site.planned.values() if cut.bone == "femur"]

    @cached_property
    def femoral_component(self) -> TriangleMesh:
        """In the femur's coordinates."""
        mesh = make_femoral_component(self._site.knee, self._femoral_cuts)
        return mesh.transform(self.motion_from_plan("femoral_implant"))

    @cached_property
    def patellar_button(self) -> TriangleMesh:
        """In the patella's coordinates."""
        mesh = make_patellar_button(self._site.knee, self._site.planned["patella"])
        return mesh.transform(self.motion_from_plan("patellar_implant"))

    @cached_property
    def tray_and_insert(self) -> tuple[TriangleMesh, TriangleMesh]:
        """In the tibia's coordinates."""
        return self._tray_and_insert(self.insert_mm)

    @cached_property
    def insert_mm(self) -> float:
        """Thickness of tray and insert that leaves the tibia nearest to where ligaments hold it."""
        touching = self._close(RESECTION_MM)
        rest = self._site.femur_from_tibia
        down = rest.rotation @ (0.0, 0.0, -1.0)
        wanted_mm = RESECTION_MM + (rest.translation_mm - touching.translation_mm) @ down
        return float(INSERTS_MM[np.abs(INSERTS_MM - wanted_mm).argmin()])

    @cached_property
    def femur_from_tibia(self) -> RigidTransform:
        """The bent knee with all components: the insert holds femur and tibia apart."""
        return self._close(self.insert_mm)

    def _tray_and_insert(self, thickness_mm: float) -> tuple[TriangleMesh, TriangleMesh]:
        cut = self._site.made["tibia_proximal"]
        return make_tray_and_insert(self._site.knee, cut, thickness_mm)

    def _close(self, thickness_mm: float) -> RigidTransform:
        """femur_from_tibia with the femoral component resting on an insert."""
        cuts = [cut for cut in self._site.made.values() if cut.bone == "femur"]
        bone = cut_skin(self._site.bones["femur"], [*cuts, *self.rasped]).largest_component()
        femur = merge_meshes([bone, self.femoral_component])
        insert = self._tray_and_insert(thickness_mm)[1]
        return slide_tibia(femur, insert, self._site.femur_from_tibia, _CONTACT_MM)

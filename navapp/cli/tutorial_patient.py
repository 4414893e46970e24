"""The simulated patient of the tutorial as files: a CT, and what is planned on it."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from navapp.cli.tutorial_folder import TutorialFolder

if TYPE_CHECKING:
    from navapp.devices import SimulatedPatient

# Between what is fine enough to navigate by and what is quick.
_VOXEL_MM = (0.6, 0.6, 0.8)
_DEPTH_MM, _DIAMETER_MM = 25.0, 9.0
_CONTENTS = """\
# What is planned for the simulated patient. Points: LPS, mm.

[[drill]]
name = "femoral_guide"
bone = "femur"
entry_mm = {entry}
direction = {direction}
depth_mm = {depth}
diameter_mm = {diameter}

[[plane]]
name = "femur_distal"
bone = "femur"
point_mm = {point}
normal = {normal}
extent_mm = {extent}

# Neither joint is in the CT.
[hip]
absent = true

[ankle]
absent = true

[stage.drilling]
bone = "femur"
drills = ["femoral_guide"]

[stage.implant]
bone = "femur"
planes = ["femur_distal"]
"""


def write_patient(folder: TutorialFolder) -> None:
    """Write the CT and the contents; the CT last, whole or not at all."""
    from navapp.config import SimulationSection
    from navapp.devices import make_simulated_patient
    from navapp.preop.volume.volume_writing import write_nifti

    patient = make_simulated_patient(SimulationSection(), _VOXEL_MM)
    folder.contents.write_text(_format_contents(patient), encoding="utf-8")
    unfinished = folder.ct.with_name(f"unfinished_{folder.ct.name}")
    write_nifti(unfinished, patient.ct.hounsfield, patient.ct.spacing_mm, patient.ct.origin_mm)
    unfinished.replace(folder.ct)


def _format_contents(patient: "SimulatedPatient") -> str:
    cut = patient.cuts["femur_distal"]
    return _CONTENTS.format(
        entry=_row(patient.drill_entry_mm),
        direction=_row(patient.drill_direction),
        depth=_DEPTH_MM,
        diameter=_DIAMETER_MM,
        point=_row(cut.point_mm),
        normal=_row(cut.normal),
        extent=_row(cut.extent_mm),
    )


def _row(numbers: Iterable[float]) -> str:
    return "[" + ", ".join(f"{float(number):.4f}" for number in numbers) + "]"

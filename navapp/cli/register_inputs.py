"""Reads the inputs of `navapp register`, converts them to mm and warns of doubtful ones."""

import argparse
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from navapp.geometry.transform import RigidTransform

if TYPE_CHECKING:
    from navapp.cli.cloud_files import ModelFile, SceneFile
    from navapp.registration import RegistrationModel, Scene

_MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
# Without a unit, the model's points count as this far apart: as those of a bone's surface.
_SPACING_MM = 1.5
_SYNONYMS = {"millimeter": "mm", "millimetre": "mm", "meter": "m", "metre": "m"}
_DOUBTFUL_RATIO = 100.0
# No bone measures more or less than this.
_SMALLEST_MM, _LARGEST_MM = 5.0, 5000.0


@dataclass(frozen=True, slots=True, eq=False)
class RegisterInputs:
    """Scene, model and start of a registration in mm, with the conversion to the files' unit."""

    # scene, model: in mm.
    scene: "Scene"
    model: "RegistrationModel"
    file: "ModelFile"  # the model as its file holds it, in the files' unit
    start: RigidTransform  # rough `scene_from_model`, mm
    factor: float  # mm per unit of the files
    warnings: tuple[str, ...]  # what the user should know, in words
    # read_ms, prepare_ms: how long it took to read the files, and to make them ready.
    read_ms: float
    prepare_ms: float

    def pose(self, scene_from_model: RigidTransform) -> RigidTransform:
        """A pose in the files' unit."""
        shift = scene_from_model.translation_mm / self.factor
        return RigidTransform.from_parts("scene", "model", scene_from_model.rotation, shift)

    def length(self, length_mm: float | None) -> float | None:
        """A length in the files' unit."""
        return None if length_mm is None else length_mm / self.factor


def read_inputs(options: argparse.Namespace) -> RegisterInputs:
    """Both files and the start, in mm, ready to be registered.

    Raises:
        InputError: a file that is missing, damaged or holds no surface.
        PriorError: a start that is no pose.
    """
    from navapp.cli.cloud_files import read_model, read_scene
    from navapp.cli.pose_files import read_pose
    from navapp.cli.surface_cleaning import measure_spacing
    from navapp.geometry.mesh import TriangleMesh
    from navapp.registration import RegistrationModel, Scene
    from navapp.values import BoneModel

    started = time.perf_counter()
    scene, model = read_scene(options.scene), read_model(options.model)
    factor = _MM_PER_UNIT.get(options.units) or _SPACING_MM / measure_spacing(
        model.mesh.vertices_mm
    )
    start = RigidTransform.identity("scene", "model")
    if options.initial:
        start = read_pose(options.initial, "scene", "model", factor)
    read_ms = compute_since_ms(started)
    started = time.perf_counter()
    mesh = TriangleMesh(factor * model.mesh.vertices_mm, model.mesh.faces, model.mesh.normals)
    ready = RegistrationModel(BoneModel("model", mesh, is_removed=model.is_removed))
    _ = ready.arrays  # made at first use
    camera_mm = None if options.camera is None else factor * np.array(options.camera)
    seen = Scene(factor * scene.points, camera_mm=camera_mm)
    prepare_ms = compute_since_ms(started)
    warnings = tuple(_warnings(scene, model, options))
    return RegisterInputs(seen, ready, model, start, factor, warnings, read_ms, prepare_ms)


def _warnings(scene: "SceneFile", model: "ModelFile", options: argparse.Namespace) -> list[str]:
    """What was done to the files, and what speaks against their unit."""
    from navapp.cli.cloud_files import size_of

    warnings = [f"scene {options.scene}: {note}" for note in scene.notes]
    warnings += [f"model {options.model}: {note}" for note in model.notes]
    for path, unit in ((options.scene, scene.unit), (options.model, model.unit)):
        said = _SYNONYMS.get((unit or "").rstrip("s"), unit)
        if options.units != "none" and said not in (None, "none", options.units):
            warnings.append(f"{path} says that its unit is {unit}, --units says {options.units}")
    sizes = size_of(scene.points), size_of(model.mesh.vertices_mm)
    ratio = max(sizes) / min(sizes) if min(sizes) > 0.0 else 1.0
    if ratio >= _DOUBTFUL_RATIO:
        larger, smaller = ("scene", "model") if sizes[0] > sizes[1] else ("model", "scene")
        about = 10 ** round(float(np.log10(ratio)))
        warnings.append(
            f"the {larger} is about {about} times as large as the {smaller} (ratio {ratio:.0f}): "
            + ("is one of them in m?" if options.units != "none" else "is their unit the same?")
        )
    if options.units != "none":
        across = float(np.ptp(model.mesh.vertices_mm, axis=0).max())
        if not _SMALLEST_MM <= across * _MM_PER_UNIT[options.units] <= _LARGEST_MM:
            warnings.append(
                f"the model is {across:.3g} {options.units} across, which is no bone's size: "
                "is --units right?"
            )
    return warnings


def compute_since_ms(started: float) -> float:
    """Since a reading of `time.perf_counter`."""
    return (time.perf_counter() - started) * 1e3

"""A calibrated stereo rig and its file (OpenCV YAML)."""

import hashlib
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.transform import RigidTransform
from navapp.geometry.whole_files import write_whole

# What other programs call the same thing; the first name is ours.
_SYNONYMS = {
    "K1": ("K1", "M1", "cameraMatrix1", "camera_matrix_1"),
    "D1": ("D1", "distCoeffs1", "distortion_coefficients_1"),
    "K2": ("K2", "M2", "cameraMatrix2", "camera_matrix_2"),
    "D2": ("D2", "distCoeffs2", "distortion_coefficients_2"),
    "R": ("R",),
    "T": ("T",),
}


@dataclass(frozen=True, slots=True)
class RigQuality:
    """What the calibration that made a rig said of itself.

    Attributes:
        is_accepted: it met its limits.
        reasons: why not, otherwise empty.
        uncertainty_mm: predicted 95 % error of a triangulated point in the working volume.
    """

    is_accepted: bool
    reasons: tuple[str, ...] = ()
    uncertainty_mm: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StereoRig:
    """Two cameras and `right_from_left` (x_right = R x_left + t, mm).

    Raises:
        ValueError: cameras of different picture sizes, no baseline, wrong frame names.
    """

    left: Camera
    right: Camera
    right_from_left: RigidTransform
    serials: tuple[str, str] = ("", "")
    quality: RigQuality | None = None
    name: str = field(default="")

    def __post_init__(self) -> None:
        if (self.left.width, self.left.height) != (self.right.width, self.right.height):
            raise ValueError("both cameras of a rig need the same picture size")
        if (self.right_from_left.target, self.right_from_left.source) != ("right", "left"):
            raise ValueError("a rig needs the transform right_from_left")
        if self.baseline_mm < 1e-6:
            raise ValueError("the cameras of a rig stand at the same place: no baseline")

    @property
    def baseline_mm(self) -> float:
        """Distance of the two optical centres."""
        return float(np.linalg.norm(self.right_from_left.translation_mm))

    @property
    def width(self) -> int:
        """Of one picture, px."""
        return self.left.width

    @property
    def height(self) -> int:
        """Of one picture, px."""
        return self.left.height

    @property
    def rig_id(self) -> str:
        """Hash of the numbers: two rigs with the same geometry have the same id."""
        digest = hashlib.sha256()
        for camera in (self.left, self.right):
            # Absent coefficients are zeros, and adding 0 makes -0 a plain 0.
            distortion = np.zeros(14)
            distortion[: camera.distortion.size] = camera.distortion
            digest.update((np.round(camera.matrix, 9) + 0.0).tobytes())
            digest.update((np.round(distortion, 12) + 0.0).tobytes())
            digest.update(f"{camera.width}x{camera.height}".encode())
        digest.update((np.round(self.right_from_left.matrix, 9) + 0.0).tobytes())
        return digest.hexdigest()[:12]

    def scaled(self, factor: float) -> "StereoRig":
        """The same rig with smaller or larger pictures."""
        return StereoRig(
            self.left.scaled(factor),
            self.right.scaled(factor),
            self.right_from_left,
            self.serials,
            self.quality,
            self.name,
        )


def read_rig(path: str | Path) -> StereoRig:
    """Read a rig from OpenCV YAML, XML or JSON storage; lengths are taken as mm.

    Raises:
        RigError: missing, damaged, incomplete or impossible.
    """
    path = Path(path)
    if not path.is_file():
        raise RigError(
            f"rig file {path} does not exist",
            subject=str(path),
            remedy="give the OpenCV YAML file that the calibration wrote",
        )
    values = _read_storage(path)
    width, height = values.get("image_width"), values.get("image_height")
    missing = [key for key in _SYNONYMS if key not in values]
    if width is None or height is None:
        missing.insert(0, "image_width and image_height")
    if missing or width is None or height is None:
        raise RigError(
            f"rig file {path} lacks {', '.join(missing)}",
            subject=str(path),
            remedy="it needs K1 D1 K2 D2 R T, image_width and image_height (OpenCV's names)",
        )
    try:
        return StereoRig(
            Camera(values["K1"], values["D1"], int(width), int(height)),
            Camera(values["K2"], values["D2"], int(width), int(height)),
            RigidTransform.from_parts("right", "left", values["R"], values["T"]),
            (str(values.get("serial_left", "")), str(values.get("serial_right", ""))),
            _quality(values),
            str(values.get("rig_name", path.stem)),
        )
    except (ValueError, TypeError, OverflowError) as error:
        raise RigError(
            f"rig file {path} describes no possible rig ({error})",
            subject=str(path),
            remedy="calibrate again or restore the file",
        ) from error


def write_rig(path: str | Path, rig: StereoRig) -> None:
    """Write OpenCV YAML 1.0, whole or not at all.

    The quality record comes first: a file that is cut short later on loses numbers that it cannot
    be read without, never just the verdict.
    """
    import cv2

    # OpenCV 5 writes YAML 1.2 unless asked; older readers know 1.0 only.
    yaml_format = getattr(cv2, "FILE_STORAGE_FORMAT_YAML_1_0", cv2.FILE_STORAGE_FORMAT_YAML)
    storage = cv2.FileStorage("", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | yaml_format)
    storage.write("rig_name", rig.name)
    storage.write("rig_id", rig.rig_id)
    storage.write("serial_left", rig.serials[0])
    storage.write("serial_right", rig.serials[1])
    if rig.quality is not None:
        _write_quality(storage, rig.quality)
    storage.write("image_width", rig.width)
    storage.write("image_height", rig.height)
    for index, camera in ((1, rig.left), (2, rig.right)):
        storage.write(f"K{index}", np.array(camera.matrix))
        # One-dimensional arrays would come back in another form: write a row.
        storage.write(
            f"D{index}",
            np.array(camera.distortion if camera.distortion.size else np.zeros(5)).reshape(1, -1),
        )
    storage.write("R", np.array(rig.right_from_left.rotation))
    storage.write("T", np.array(rig.right_from_left.translation_mm).reshape(3, 1))
    write_whole(path, storage.releaseAndGetString().encode("utf-8"))


def _write_quality(storage: Any, quality: RigQuality) -> None:
    import cv2

    storage.write("accepted", int(quality.is_accepted))
    storage.startWriteStruct("reasons", cv2.FILE_NODE_SEQ)
    for reason in quality.reasons:
        storage.write("", reason)
    storage.endWriteStruct()
    storage.write(
        "uncertainty_mm", -1.0 if quality.uncertainty_mm is None else quality.uncertainty_mm
    )


def _quality(values: dict[str, Any]) -> RigQuality | None:
    if "accepted" not in values:
        return None
    uncertainty_mm = float(values.get("uncertainty_mm", -1.0))
    known = uncertainty_mm >= 0.0 and math.isfinite(uncertainty_mm)
    return RigQuality(
        int(values["accepted"]) == 1,
        tuple(values.get("reasons", ())),
        uncertainty_mm if known else None,
    )


def _read_storage(path: Path) -> dict[str, Any]:
    """Every known entry of an OpenCV storage file, under our names."""
    import cv2

    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        if not storage.isOpened():
            raise ValueError("not an OpenCV storage file")
        values = {**_read_matrices(storage), **_read_scalars(storage)}
        storage.release()
    except (cv2.error, SystemError, ValueError) as error:
        raise RigError(
            f"rig file {path} is damaged or not an OpenCV storage file",
            subject=str(path),
            remedy="restore it or calibrate again",
        ) from error
    return values


# A node must stay in a variable: the storage frees the ones that nobody holds.


def _read_matrices(storage: Any) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, synonyms in _SYNONYMS.items():
        for synonym in synonyms:
            node = storage.getNode(synonym)
            if not node.empty() and node.mat() is not None:
                values[name] = np.asarray(node.mat(), dtype=np.float64)
                break
    return values


def _read_scalars(storage: Any) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name in ("size", "image_size"):
        node = storage.getNode(name)
        if node.empty():
            continue
        size = [_number(node.at(i)) for i in range(node.size())] if node.isSeq() else node.mat()
        size = np.asarray(size, dtype=np.float64).reshape(-1)
        if size.size != 2:
            raise ValueError(f"{name} is not a width and a height")
        values["image_width"], values["image_height"] = size
    for name in ("image_width", "image_height", "accepted", "uncertainty_mm"):
        node = storage.getNode(name)
        if not node.empty():
            values[name] = _number(node)
    for name in ("serial_left", "serial_right", "rig_name"):
        node = storage.getNode(name)
        if not node.empty() and node.isString():
            values[name] = node.string()
    node = storage.getNode("reasons")
    if not node.empty() and node.isSeq():
        values["reasons"] = [node.at(i).string() for i in range(node.size())]
    return values


def _number(node: Any) -> float:
    if not (node.isInt() or node.isReal()):
        raise ValueError("a number was expected")
    return float(node.real())

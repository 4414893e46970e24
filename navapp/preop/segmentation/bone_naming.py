"""Names connected parts as bones by size and place, in patient coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.masks import LabelArray
from navapp.values import FOLLOWED_BONES

# The fibula is found to keep it apart, and to tell the side.
BONES = (*FOLLOWED_BONES, "fibula")
NOT_SEEDED: Mapping[str, int] = MappingProxyType({})

# A knee's bone ends: less than this of their inside is no femur or tibia.
_LEAST_LONG_BONE_MM3 = 10_000.0
# Femur and tibia of one leg: the joint line is found within so much of both, one above the other.
_JOINT_MM, _BESIDE_MM = 45.0, 60.0
# The patella lies before the femur's end, the fibula beside the tibia's.
_BEFORE_MM, _KNEE_MM, _FIBULA_MM = 12.0, 90.0, 70.0
# Another femur of at least this share of the first is the other leg's.
_OTHER_LEG = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Size and place of one connected part, in LPS mm."""

    number: int  # of its voxels
    volume_mm3: float  # of its inside
    centre_mm: FloatArray  # (3,) mean of its voxels
    # lower_mm, upper_mm: (3,) its box.
    lower_mm: FloatArray
    upper_mm: FloatArray


@dataclass(frozen=True, slots=True)
class NamedParts:
    """Bones found: name -> number of the part."""

    bones: Mapping[str, int]  # name -> number
    # there is another part like the femur, or like the tibia, beside it.
    has_two_knees: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether the three bones of the joint were told apart."""
        return set(FOLLOWED_BONES) <= set(self.bones)


def parts_of(labels: LabelArray, lps_from_index: FloatArray) -> list[Part]:
    """Size and place of each number above 0 in (D, H, W) labels."""
    voxel_mm3 = abs(float(np.linalg.det(lps_from_index[:3, :3])))
    parts = []
    for number, box in enumerate(_boxes(labels), start=1):
        if box is None:
            continue
        found = np.argwhere(labels[box] == number)[:, ::-1]
        first = np.array([edge.start for edge in box[::-1]])
        points = (found + first) @ lps_from_index[:3, :3].T + lps_from_index[:3, 3]
        parts.append(
            Part(
                number, len(points) * voxel_mm3, points.mean(axis=0),
                points.min(axis=0), points.max(axis=0),
            )
        )  # fmt: skip
    return parts


def _boxes(labels: LabelArray) -> list[tuple[slice, ...] | None]:
    from scipy.ndimage import find_objects

    return list(find_objects(labels))


def name_parts(parts: list[Part], seeded: Mapping[str, int] = NOT_SEEDED) -> NamedParts:
    """The bones of one knee among the parts; those that are not found are not named.

    Args:
        parts: of the volume.
        seeded: name -> number of the part that an operator named; the others are those of its knee.
    """
    bones = dict(seeded)
    large = sorted(
        (part for part in parts if part.volume_mm3 >= _LEAST_LONG_BONE_MM3),
        key=lambda part: -part.volume_mm3,
    )
    pairs = _pairs(parts, large, seeded)
    if not pairs:
        return NamedParts(bones)
    femur, tibia = max(pairs, key=lambda pair: _rank(pair, parts, seeded))
    bones |= {"femur": femur.number, "tibia": tibia.number}
    rest = [part for part in parts if part.number not in bones.values()]
    joint_mm = _joint_mm(femur, tibia)
    patella = _largest([part for part in rest if _is_patella(part, femur, joint_mm)])
    if patella is not None and "patella" not in bones:
        bones["patella"] = patella.number
        rest.remove(patella)
    fibula = _largest([part for part in rest if _is_fibula(part, tibia)])
    if fibula is not None and "fibula" not in bones:
        bones["fibula"] = fibula.number
    others = [part for part in large if part.number not in bones.values()]
    return NamedParts(bones, any(_is_of_other_leg(part, femur, tibia) for part in others))


def _pairs(
    parts: list[Part], large: list[Part], seeded: Mapping[str, int]
) -> list[tuple[Part, Part]]:
    """What may be femur and tibia of one leg, as seeds allow; two that are seeded are, anyhow."""

    def candidates(name: str) -> list[Part]:
        if name in seeded:
            return [part for part in parts if part.number == seeded[name]]
        return [part for part in large if part.number not in seeded.values()]

    is_said = {"femur", "tibia"} <= set(seeded)
    return [
        (femur, tibia)
        for femur in candidates("femur")
        for tibia in candidates("tibia")
        if is_said or _is_above(femur, tibia)
    ]


def _rank(
    pair: tuple[Part, Part], parts: list[Part], seeded: Mapping[str, int]
) -> tuple[int, float]:
    """How many of the seeded parts are of a pair's leg, and how large it is."""
    femur, tibia = pair
    x_mm = _joint_mm(femur, tibia)[0]
    chosen = [part for part in parts if part.number in seeded.values()]
    n_beside = sum(abs(float(part.centre_mm[0] - x_mm)) < _BESIDE_MM for part in chosen)
    return n_beside, femur.volume_mm3 + tibia.volume_mm3


def _joint_mm(femur: Part, tibia: Part) -> FloatArray:
    """(3,) below the middle of a femur, half way to its tibia."""
    return np.array([*femur.centre_mm[:2], 0.5 * (femur.lower_mm[2] + tibia.upper_mm[2])])


def _is_above(femur: Part, tibia: Part) -> bool:
    """Whether one bone stands on the other; a patella lies before it, as low as its end or not."""
    if femur is tibia or femur.lower_mm[2] <= tibia.centre_mm[2]:
        return False
    gap_mm = femur.lower_mm[2] - tibia.upper_mm[2]
    middles = 0.5 * (femur.lower_mm + femur.upper_mm - tibia.lower_mm - tibia.upper_mm)[:2]
    return abs(float(gap_mm)) < _JOINT_MM and float(np.hypot(*middles)) < _BESIDE_MM


def _is_patella(part: Part, femur: Part, joint_mm: FloatArray) -> bool:
    middle = 0.5 * (femur.lower_mm[1] + femur.upper_mm[1])
    return (
        part.volume_mm3 < 0.5 * femur.volume_mm3
        and part.centre_mm[1] < middle - _BEFORE_MM
        and bool((np.abs(part.centre_mm - joint_mm) < _KNEE_MM).all())
    )


def _is_fibula(part: Part, tibia: Part) -> bool:
    beside_mm = float(np.hypot(*(part.centre_mm - tibia.centre_mm)[:2]))
    return (
        part.volume_mm3 < 0.5 * tibia.volume_mm3
        and part.upper_mm[2] < tibia.upper_mm[2]
        and part.centre_mm[1] > tibia.lower_mm[1]
        and beside_mm < _FIBULA_MM
    )


def _is_of_other_leg(part: Part, femur: Part, tibia: Part) -> bool:
    return any(
        part.volume_mm3 > _OTHER_LEG * bone.volume_mm3
        and abs(part.centre_mm[2] - bone.centre_mm[2]) < _KNEE_MM
        and abs(part.centre_mm[0] - bone.centre_mm[0]) > _BESIDE_MM
        for bone in (femur, tibia)
    )


def _largest(parts: list[Part]) -> Part | None:
    return max(parts, key=lambda part: part.volume_mm3, default=None)

"""Names bones by points that an operator gives."""

from collections.abc import Mapping

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.preop.segmentation.bone_naming import NamedParts, Part, name_parts
from navapp.preop.segmentation.masks import LabelArray
from navapp.preop.volume import CtVolume

# A core is a bone without its cortex: a point that was clicked on the surface is this far from it.
_REACH_MM = 12.0


def with_seeds(
    parts: list[Part], cores: LabelArray, ct: CtVolume, seeds: Mapping[str, FloatArray]
) -> NamedParts:
    """Names by seeds first; what has no seed is named by its place in the seeded knee.

    A seed that is near no core, or near the core of another seed, names nothing, and its name is
    given to nothing else: better not named than named against what the operator said.
    """
    by_seed: dict[str, int] = {}
    for name, point_mm in seeds.items():
        core = _nearest_core(cores, ct, point_mm)
        if core and core not in by_seed.values():
            by_seed[name] = core
    named = name_parts(parts, by_seed)
    bones = {name: n for name, n in named.bones.items() if name in by_seed or name not in seeds}
    return NamedParts(bones, named.has_two_knees)


def _nearest_core(cores: LabelArray, ct: CtVolume, point_mm: FloatArray) -> int:
    """The number of the core within reach of a point that is nearest to it; 0 for none."""
    index = ct.indices_of(point_mm[None])[0]
    reach = np.ceil(_REACH_MM / ct.spacing_mm).astype(int)
    lower = np.clip(np.floor(index).astype(int) - reach, 0, ct.size)
    upper = np.clip(np.ceil(index).astype(int) + reach + 1, 0, ct.size)
    (i0, j0, k0), (i1, j1, k1) = lower, upper
    found = np.argwhere(cores[k0:k1, j0:j1, i0:i1] > 0)[:, ::-1] + lower
    if len(found) == 0:
        return 0
    away_mm = np.linalg.norm(ct.points_lps_mm(found) - point_mm, axis=1)
    nearest = int(away_mm.argmin())
    i, j, k = found[nearest]
    return int(cores[k, j, i]) if away_mm[nearest] <= _REACH_MM else 0

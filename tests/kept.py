"""Simulated knees, CTs, tissue, components and drawn meshes, kept on disk: making one takes long.

Folders are named after a hash of the sources and the libraries that make what is in them, files
after its parameters: what is read is what would be made now. They may be deleted at any time.
"""

import fcntl
import hashlib
import io
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields
from functools import cache, lru_cache, wraps
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from navapp.geometry import simplify
from navapp.geometry.mesh import TriangleMesh
from sim_devices import anatomy, components, tissue
from sim_devices.anatomy import KneeAnatomy, KneeSpec
from sim_devices.bone_shapes import ShapeDraws
from sim_devices.ct_volume import CtVolume
from sim_devices.ct_volume import make_ct as make_new_ct
from sim_devices.planned_cuts import Cut
from sim_devices.tissue import Sheet

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / ".pytest_cache" / "kept"
# All that a knee is made of; more than it needs costs no more than making it again.
LIBRARIES = (
    "numpy", "scipy", "numba", "llvmlite", "fast-simplification", "opencv-python-headless",
)  # fmt: skip
SOURCES = ("sim_devices", "navapp/geometry", "tests/kept.py")

_OLD_S = 24 * 3600.0

Arrays = dict[str, np.ndarray]
_Made = TypeVar("_Made", TriangleMesh, Sheet)

make_new_knee = anatomy.make_knee
make_new_tissue = tissue.make_tissue
make_new_simplified = simplify.simplify
make_new_femoral_component = components.make_femoral_component
_FIRST = KneeSpec()


@cache
def sources_hash() -> str:
    """Of the simulator, what it stands on, and the libraries that compute it."""
    libraries = [version(name) for name in LIBRARIES]
    checks = os.environ.get("NUMBA_BOUNDSCHECK"), os.environ.get("NUMBA_OPT")
    digest = hashlib.sha256(f"{sys.version} {libraries} {checks}".encode())
    for source in SOURCES:
        path = ROOT / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(str(file.relative_to(ROOT)).encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def keep(folder: Path, what: object, make: Callable[[], Arrays]) -> Arrays:
    """The arrays that `make` makes, from disk when they are there: made once by all workers.

    Args:
        folder: where they are kept.
        what: whose `repr` names them among all that the same sources make.
        make: deterministic.
    """
    own = folder / sources_hash()[:24]
    path = own / f"{hashlib.sha256(repr(what).encode()).hexdigest()[:24]}.npz"
    found = _read(path)
    if found is not None:
        return found
    if not own.is_dir():
        own.mkdir(parents=True, exist_ok=True)
        _remove_old(folder)
    with path.with_suffix(".lock").open("w") as lock:
        # One makes it, the others wait here and then read.
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = _read(path)
        if found is None:
            found = make()
            _write(path, found)
    return found


def _remove_old(folder: Path) -> None:
    """What other sources made, unless somebody may still be at it."""
    for other in folder.iterdir():
        if time.time() - other.stat().st_mtime > _OLD_S:
            shutil.rmtree(other, ignore_errors=True)


def _read(path: Path) -> Arrays | None:
    """None when the file is missing, or is not what was written."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    told, body = content[:32], content[32:]
    if hashlib.sha256(body).digest() != told:
        return None
    with np.load(io.BytesIO(body), allow_pickle=False) as stored:
        return dict(stored)


def _write(path: Path, arrays: Arrays) -> None:
    body = io.BytesIO()
    np.savez(body, **arrays)
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(hashlib.sha256(body.getvalue()).digest())
        file.write(body.getvalue())
    os.replace(file.name, path)


class _Solids(Mapping[str, Any]):
    """The solids of a knee: functions, which no file holds. Few ask: the knee is then made."""

    def __init__(self, spec: KneeSpec) -> None:
        self._spec = spec

    def __getitem__(self, name: str) -> Any:
        return make_new_knee(self._spec).solids[name]

    def __iter__(self) -> Iterator[str]:
        return iter(("femur", "tibia", "patella"))

    def __len__(self) -> int:
        return 3


@lru_cache(maxsize=40)
def make_knee(spec: KneeSpec = _FIRST) -> KneeAnatomy:
    """`sim_devices.anatomy.make_knee`, kept."""
    arrays = keep(FOLDER, spec, lambda: _arrays_of(make_new_knee(spec)))
    parts: dict[str, dict[str, Any]] = {}
    for key, array in arrays.items():
        part, _, name = key.partition(":")
        parts.setdefault(part, {})[name] = array
    bones = {
        name: TriangleMesh(vertices, parts["faces"][name], parts["normals"][name])
        for name, vertices in parts["vertices"].items()
    }
    return KneeAnatomy(
        spec,
        MappingProxyType(bones),
        MappingProxyType(parts["landmarks"]),
        MappingProxyType(parts["curves"]),
        _Solids(spec),
        arrays["scale"],
        ShapeDraws(**{name: float(value) for name, value in parts["shape"].items()}),
    )


def _arrays_of(knee: KneeAnatomy) -> Arrays:
    arrays = {"scale": knee.scale}
    for name, mesh in knee.bones.items():
        arrays[f"vertices:{name}"] = mesh.vertices_mm
        arrays[f"faces:{name}"] = mesh.faces
        arrays[f"normals:{name}"] = mesh.normals
    arrays |= {f"landmarks:{name}": np.asarray(p) for name, p in knee.landmarks.items()}
    arrays |= {f"curves:{name}": np.asarray(points) for name, points in knee.curves.items()}
    for one in fields(ShapeDraws):
        arrays[f"shape:{one.name}"] = np.asarray(getattr(knee.shape, one.name))
    return arrays


def make_ct(spec: KneeSpec, spacing_mm: tuple[float, float, float], seed: int) -> CtVolume:
    """`sim_devices.ct_volume.make_ct` of a knee, kept."""
    arrays = keep(
        FOLDER,
        (spec, spacing_mm, seed),
        lambda: asdict(make_new_ct(make_new_knee(spec), spacing_mm, seed)),
    )
    return CtVolume(**arrays)


def _kept(make: Callable[..., _Made]) -> Callable[..., _Made]:
    """A maker of a mesh or of a sheet, whose answers are kept under its name and its arguments."""

    @wraps(make)
    def make_or_read(*arguments: Any, **named: Any) -> _Made:
        what = make.__qualname__, _content(arguments), _content(sorted(named.items()))
        return _made_of(keep(FOLDER, what, lambda: _arrays_of_made(make(*arguments, **named))))

    return make_or_read


make_tissue = _kept(make_new_tissue)
make_femoral_component = _kept(make_new_femoral_component)
_keep_simplified = _kept(make_new_simplified)


def make_simplified(mesh: TriangleMesh, n_vertices: int, within_mm: float) -> TriangleMesh:
    """`navapp.geometry.simplify.simplify`, kept; what has few vertices anyway comes back itself."""
    is_small = not 0 < n_vertices < len(mesh.vertices_mm)
    return mesh if is_small else _keep_simplified(mesh, n_vertices, within_mm)


def _content(value: Any) -> Any:
    """What tells an argument from others by its `repr`; a knee is what its spec says."""
    if isinstance(value, TriangleMesh):
        return _hash_of(value)
    if isinstance(value, KneeAnatomy):
        return value.spec
    if isinstance(value, Cut):
        return value.point_mm.tolist(), value.normal.tolist()
    if isinstance(value, list | tuple):
        return [_content(one) for one in value]
    assert isinstance(value, str | int | float), f"{type(value)} has no name among what is kept"
    return value


def _hash_of(mesh: TriangleMesh) -> str:
    arrays = mesh.vertices_mm, mesh.faces, mesh.normals
    return hashlib.sha256(b"".join(one.tobytes() for one in arrays)).hexdigest()


def _arrays_of_made(made: TriangleMesh | Sheet) -> Arrays:
    if isinstance(made, Sheet):
        return {**_arrays_of_made(made.mesh), "mark": made.mark, "exposure": made.exposure}
    return {"vertices": made.vertices_mm, "faces": made.faces, "normals": made.normals}


def _made_of(arrays: Arrays) -> Any:
    mesh = TriangleMesh(arrays["vertices"], arrays["faces"], arrays["normals"])
    return Sheet(mesh, arrays["mark"], arrays["exposure"]) if "mark" in arrays else mesh


def install() -> None:
    """Replace the makers by the kept ones in all modules that are imported after this."""
    sources_hash()  # of the sources as they were imported, whatever is edited meanwhile
    anatomy.make_knee = make_knee
    tissue.make_tissue = make_tissue
    components.make_femoral_component = make_femoral_component
    simplify.simplify = make_simplified

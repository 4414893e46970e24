"""Recorded operations with a plan that is wrong: no frame may be called OK.

usage: python -m tests.bench.wrong_plans [FOLDER] [--only NAME]

The plan's femur is that of another person, of the other side, or of another size; or the pictures
are swapped. Every sequence is replayed with each frame as the first. 2 % of size is what a
segmentation may be off by: those rows are there to be seen, not to be refused.
"""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from navapp.cli.main import run
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply, write_ply
from tests.bench.wrong_bones import OTHER_SIDE, stretch

_OTHERS = ("femur_1", "femur_2", "femur_3")
_SIZES = (0.95, 0.98, 1.02, 1.05)


def main() -> int:
    """Print what became of the frames of every sequence and wrong plan."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--only", default="", help="sequences whose name contains this")
    options = parser.parse_args()
    folder = Path(options.folder)
    print("| plan | sequence | OK | DEGRADED | LOST | most frequent reason |")
    print("|---|---|---|---|---|---|")
    for phantom in sorted(folder.glob("phantom_*")):
        own = read_ply(phantom / "femur.ply")[0]
        sequences = [
            prior.parent
            for prior in sorted(phantom.glob("*/prior.json"))
            if options.only in f"{phantom.name}/{prior.parent.name}"
        ]
        for name, mesh in _wrong(own, folder):
            for sequence in sequences:
                frames = replayed(phantom, sequence, mesh, is_swapped=name == "pictures swapped")
                print(_row(name, f"{phantom.name}/{sequence.name}", frames), flush=True)
    return 0


def _wrong(own: TriangleMesh, folder: Path) -> Iterator[tuple[str, TriangleMesh]]:
    """Wrong femurs where the right one lies."""
    yield "pictures swapped", own
    yield "other side", stretch(own, OTHER_SIDE)
    for name in _OTHERS:
        yield f"another person ({name})", _moved_onto(own, read_other(folder, name))
    for size in _SIZES:
        yield f"size x {size:g}", stretch(own, size)


def read_other(folder: Path, name: str) -> TriangleMesh:
    """Another person's femur, outward."""
    mesh = read_ply(folder / "bones" / "pymskt" / f"{name}.ply")[0].largest_component()
    return mesh if mesh.volume_mm3() > 0.0 else mesh.flip()


def _moved_onto(own: TriangleMesh, other: TriangleMesh) -> TriangleMesh:
    """Its joint end where that of the own one lies."""

    def place(mesh: TriangleMesh) -> np.ndarray:
        vertices = mesh.vertices_mm
        end = vertices[vertices[:, 2] < vertices[:, 2].min() + 40.0]
        return np.array([*end[:, :2].mean(axis=0), vertices[:, 2].min()])

    return TriangleMesh(other.vertices_mm - place(other) + place(own), other.faces)


def replayed(
    phantom: Path, sequence: Path, mesh: TriangleMesh, *, is_swapped: bool
) -> list[dict[str, Any]]:
    """Frames of `navapp replay`, each on its own."""
    with tempfile.TemporaryDirectory() as folder:
        surface, plan, poses = f"{folder}/wrong.ply", f"{folder}/plan", f"{folder}/poses.json"
        write_ply(surface, mesh, space="LPS")
        run(["--quiet", "plan", "--surface", f"femur={surface}", "--out", plan])
        pictures = _swapped(sequence, Path(folder)) if is_swapped else sequence
        run([
            "--quiet", "replay", str(pictures), "--rig", str(phantom / "rig.yml"), "--plan", plan,
            "--prior", str(sequence / "prior.json"), "--order", "each", "--json", poses,
        ])  # fmt: skip
        frames: list[dict[str, Any]] = json.loads(Path(poses).read_text())["frames"]
        return frames


def _swapped(sequence: Path, folder: Path) -> Path:
    """The same pictures, left called right."""
    pictures = folder / "swapped"
    pictures.mkdir()
    for path in sequence.glob("left_*.jpg"):
        (pictures / path.name.replace("left", "right")).symlink_to(path.resolve())
    for path in sequence.glob("right_*.jpg"):
        (pictures / path.name.replace("right", "left")).symlink_to(path.resolve())
    return pictures


def _row(name: str, sequence: str, frames: list[dict[str, Any]]) -> str:
    states = Counter(frame["status"] for frame in frames)
    reasons = Counter(reason for frame in frames for reason in frame["reasons"])
    said = reasons.most_common(1)[0][0] if reasons else "-"
    counts = " | ".join(str(states[state]) for state in ("OK", "DEGRADED", "LOST"))
    return f"| {name} | {sequence} | {counts} | {said} |"


if __name__ == "__main__":
    sys.exit(main())

"""Recorded operations on a sawn femur: poses, and faces of the cuts, against the truth.

usage: python -m tests.bench.cut_bone [FOLDER]

FOLDER (default: NAVAPP_DATA) holds `cut_*` folders with the whole surface, the planned planes
(contents.toml), the planes as made (cuts.json), rig.yml and sequences that have prior.json and
truth.json. Each sequence is replayed with its cuts confirmed, and as if nobody had told of them.
Where the whole bone was recorded as well (`phantom_*` with the same surface), it is replayed with
the same cuts confirmed, which nobody made. Unrelated frames are registered one by one.
"""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from navapp.cli.main import run
from tests.bench.recorded_accuracy import (
    UNRELATED,
    find_sequences,
    replayed,
    score_frames,
)


def main() -> int:
    """Print a row for each sequence and way."""
    parser = argparse.ArgumentParser(description=__doc__)
    folder = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=folder)
    options = parser.parse_args()
    print("| sequence | cuts | frames | OK | TRE median mm | worst OK | bound holds | faces: "
          "measured, median deg, median mm, bounds hold |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    for cut in sorted(Path(options.folder).glob("cut_*")):
        made = json.loads((cut / "cuts.json").read_text(encoding="utf-8"))["cuts"]
        words = [word for one in made for word in ("--cut", one["name"])]
        surface = (cut / "femur.ply").read_bytes()
        with tempfile.TemporaryDirectory() as plan:
            run(["--quiet", "plan", "--surface", f"femur={cut / 'femur.ply'}", "--side", "right",
                 "--contents", str(cut / "contents.toml"), "--out", plan])  # fmt: skip
            _rows(cut, plan, "confirmed", words, made)
            _rows(cut, plan, "not told of", [], made)
            for phantom in sorted(Path(options.folder).glob("phantom_*")):
                if (phantom / "femur.ply").read_bytes() == surface:
                    _rows(phantom, plan, "confirmed, not made", words, [])
    return 0


def _rows(root: Path, plan: str, told: str, words: list[str], made: list[dict[str, Any]]) -> None:
    for sequence in find_sequences(root, ""):
        order = "each" if sequence.name in UNRELATED else "forward"
        frames = replayed(root, sequence, plan, order, "femur", *words)
        scored = list(score_frames(frames, sequence, "femur", root / "femur.ply"))
        ok = [one for one in scored if one.status == "OK"]
        off_mm = np.array([one.tre_mm for one in ok])
        is_held = off_mm <= np.array([one.bound_mm for one in ok])
        holds = f"{100 * is_held.mean():.0f} %" if ok else "-"
        errors = f"{np.median(off_mm):.3f} | {off_mm.max():.3f}" if ok else "- | -"
        faces = "; ".join(_face(one, frames) for one in made)
        n_other = sum(len(frame["measured"]) for frame in frames) if not made else 0
        faces = faces or f"{n_other} measured"
        print(
            f"| {root.name}/{sequence.name} | {told} | {len(frames)} | {len(ok)} | {errors} | "
            f"{holds} | {faces} |",
            flush=True,
        )


def _face(made: dict[str, Any], frames: list[dict[str, Any]]) -> str:
    """What the frames have measured of one face, against the plane as made."""
    point, normal = (np.array(made["made"][key]) for key in ("point", "normal"))
    found = [
        frame["measured"][made["name"]] for frame in frames if made["name"] in frame["measured"]
    ]
    if not found:
        return f"{made['name']} 0"
    normals = np.array([one["normal"] for one in found])
    points = np.array([one["point_mm"] for one in found])
    angle_deg = np.degrees(np.arccos(np.clip(normals @ normal, -1.0, 1.0)))
    off_mm = np.abs(np.einsum("ij,ij->i", points - point, normals) / (normals @ normal))
    holds = (angle_deg <= [one["bound_deg"] for one in found]) & (
        off_mm <= [one["bound_mm"] for one in found]
    )
    return (
        f"{made['name']} {len(found)}, {np.median(angle_deg):.2f}, {np.median(off_mm):.3f}, "
        f"{100 * holds.mean():.0f} %"
    )


if __name__ == "__main__":
    sys.exit(main())

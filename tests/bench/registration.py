"""Registration of bones in clutter: success, error and time, beside Open3D and small_gicp.

usage: python -m tests.bench.registration [FOLDER] [--seeds N] [--vertices N] [--from DEG MM]
                                           [--no-peers] [--only NAME] [--lists]
       python -m tests.bench.registration [FOLDER] --speed

Every method is given the same clouds and the same start; a peer's row is its best setting. With
--lists the peers also get the list of starts that navapp tries (slow). With --speed only one call
from 5 deg / 5 mm is timed, in turns with Open3D at the same accuracy, and the search from many.
"""

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "2")

import numpy as np
from scipy.spatial import cKDTree

from navapp.geometry.transform import RigidTransform
from navapp.registration import (
    Outcome,
    RegistrationModel,
    Scene,
    fit_bimcc,
    make_far_starts,
    make_near_starts,
    register,
    solve_bimcc_literal,
    solve_icp,
)
from tests.bench.registration_peers import RADII_MM, Peer, open3d_plane, peers
from tests.bench.registration_scenes import (
    BONES,
    Bone,
    Clouded,
    error_mm,
    information_limit_mm,
    least_share,
    load_bone,
    scenes,
)

_STARTS = ((5.0, 5.0), (10.0, 8.0), (25.0, 15.0), (45.0, 20.0))
_SUCCESS_MM, _SILENT_MM = 1.0, 2.0
_NEAR_MM = 2.0
_PAUSE_S = 0.02


@dataclass
class Row:
    """What one method reached on all scenes of one start."""

    errors_mm: list[float] = field(default_factory=list)
    ms: list[float] = field(default_factory=list)
    by_bone: dict[str, list[float]] = field(default_factory=dict)
    n_silent: int = 0
    n_unsaid: int = 0

    def add(self, bone: str, error: float, ms: float, outcome: Outcome | None = None) -> None:
        """One run; peers have no outcome."""
        self.errors_mm.append(error)
        self.ms.append(ms)
        self.by_bone.setdefault(bone, []).append(error)
        self.n_silent += outcome is Outcome.CONVERGED and error > _SILENT_MM
        is_doubted = outcome is not None and outcome is not Outcome.CONVERGED
        self.n_unsaid += is_doubted and error < _SUCCESS_MM

    @property
    def success(self) -> float:
        """Share below 1 mm."""
        return float((np.array(self.errors_mm) < _SUCCESS_MM).mean())

    @property
    def tre_mm(self) -> float:
        """Median error of the successes."""
        right = [error for error in self.errors_mm if error < _SUCCESS_MM]
        return float(np.median(right)) if right else float("nan")


Method = Callable[[Clouded, RegistrationModel], tuple[RigidTransform, Outcome | None]]


def main() -> None:
    """Print the tables."""
    options = _options()
    bones = [
        load_bone(Path(options.folder) / "bones" / "pymskt", name, options.vertices)
        for name in BONES
    ]
    print(f"model of {options.vertices} vertices, {options.seeds} seeds a bone; "
          "success | TRE of successes mm | ms")  # fmt: skip
    if options.speed:
        _speed(bones, options.seeds)
        return
    limit = [
        information_limit_mm(bone, scene)
        for bone in bones
        for scene in scenes(bone, 5.0, 5.0, options.seeds)
    ]
    shares = [
        least_share(bone, scene)
        for bone in bones
        for scene in scenes(bone, 5.0, 5.0, options.seeds)
    ]
    print(f"information, least over largest eigenvalue: {min(shares):.3f} to {max(shares):.3f}")
    print(f"information limit: {np.median(limit):.3f} mm median, "
          f"{np.percentile(limit, 95):.3f} at 95 %")  # fmt: skip
    families = {} if options.no_peers else peers()
    for turn, shift in [options.start] if options.start else _STARTS:
        print(f"from {turn:g} deg / {shift:g} mm")
        for name, method in _own().items():
            if options.only in name:
                _print(name, _run(bones, method, turn, shift, options.seeds))
        for family, settings in families.items():
            _best(family, settings, bones, turn, shift, options.seeds)
            if options.lists and turn >= 25.0:
                _lists(family, settings, bones, turn, shift, options.seeds)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--vertices", type=int, default=7000, help="of the model; 1500 is coarse")
    parser.add_argument(
        "--from", dest="start", type=float, nargs=2, metavar=("DEG", "MM"), help="this start only"
    )
    parser.add_argument("--only", default="", help="of navapp's methods those with this name")
    parser.add_argument("--speed", action="store_true", help="time only")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument(
        "--lists", action="store_true", help="peers get navapp's list of starts too"
    )
    return parser.parse_args()


def _own() -> dict[str, Method]:
    def once(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        return fit_bimcc(_seen(scene), model, scene.start).camera_from_bone, None

    def checked(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        found = register(_seen(scene), model, scene.start)
        return found.estimate.camera_from_bone, found.outcome

    def many(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        found = register(_seen(scene), model, scene.start, is_global=True)
        return found.estimate.camera_from_bone, found.outcome

    def literal(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        return solve_bimcc_literal(_seen(scene), model, scene.start).estimate.camera_from_bone, None

    def plain(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        return solve_icp(_seen(scene), model, scene.start).estimate.camera_from_bone, None

    return {
        "bimcc, the loops alone": once,
        "bimcc (doubtful answers are tried again)": checked,
        "bimcc --global": many,
        "bimcc-literal": literal,
        "icp": plain,
    }


def _seen(scene: Clouded) -> Scene:
    return Scene(scene.points_mm, camera_mm=scene.camera_mm)


def _run(bones: list[Bone], method: Method, turn: float, shift: float, n_seeds: int) -> Row:
    row = Row()
    for bone in bones:
        for scene in scenes(bone, turn, shift, n_seeds):
            began = time.perf_counter()
            pose, outcome = method(scene, bone.model)
            ms = 1e3 * (time.perf_counter() - began)
            row.add(bone.name, error_mm(bone, pose, scene), ms, outcome)
    return row


def _speed(bones: list[Bone], n_seeds: int) -> None:
    """One call and the search from many starts, in turns with the peer's accurate settings."""
    own = _own()
    exact = {
        f"Open3D, r {radius:g}, loss 2, stop {stop:g}": _as_method(open3d_plane(radius, 2.0, stop))
        for radius in RADII_MM
        for stop in (1e-6, 1e-4)
    }
    once, many = own["bimcc, the loops alone"], own["bimcc --global"]
    rows = {name: Row() for name in ("one call", "many starts", *exact)}
    for bone in bones:
        for scene in scenes(bone, 5.0, 5.0, n_seeds):
            for name, method in {"one call": once, "many starts": many, **exact}.items():
                time.sleep(_PAUSE_S)  # threads of the call before may still spin
                began = time.perf_counter()
                pose, _ = method(scene, bone.model)
                ms = 1e3 * (time.perf_counter() - began)
                rows[name].add(bone.name, error_mm(bone, pose, scene), ms)
    for name, row in rows.items():
        _print(name, row)
    fastest = min(np.median(rows[name].ms) for name in exact)
    ratio = np.median(rows["one call"].ms) / fastest
    print(f"one call takes {ratio:.2f} of Open3D's fastest")


def _as_method(peer: Peer) -> Method:
    def fit(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        return peer(scene.points_mm, model, scene.start), None

    return fit


def _best(
    family: str, settings: dict[str, Peer], bones: list[Bone], turn: float, shift: float, seeds: int
) -> None:
    """The setting of most successes, and of those that mostly succeed the one of least error."""
    rows = {name: _run(bones, _as_method(peer), turn, shift, seeds)
            for name, peer in settings.items()}  # fmt: skip
    widest = max(rows, key=lambda name: rows[name].success)
    _print(f"{family} ({widest})", rows[widest])
    useful = [name for name in rows if rows[name].success >= 0.5]
    if useful:
        finest = min(useful, key=lambda name: rows[name].tre_mm)
        if finest != widest:
            _print(f"{family} ({finest})", rows[finest])


def _lists(
    family: str, settings: dict[str, Peer], bones: list[Bone], turn: float, shift: float, seeds: int
) -> None:
    """A peer from all of navapp's starts; the answer with most points on the model counts."""
    few = {name: _run(bones, _as_method(peer), turn, shift, min(seeds, 5))
           for name, peer in settings.items()}  # fmt: skip
    name = max(few, key=lambda setting: few[setting].success)
    peer = settings[name]

    def fit(scene: Clouded, model: RegistrationModel) -> tuple[RigidTransform, Outcome | None]:
        place_mm = scene.start.apply(model.centre_mm)
        starts = make_near_starts(scene.start, place_mm) + make_far_starts(scene.start, place_mm)
        poses = [peer(scene.points_mm, model, start) for start in starts]
        return max(poses, key=lambda pose: _on_model(pose, scene, model)), None

    _print(f"{family} ({name}), all starts", _run(bones, fit, turn, shift, seeds))


def _on_model(pose: RigidTransform, scene: Clouded, model: RegistrationModel) -> float:
    distance, _ = cKDTree(model.points_mm).query(pose.inverse().apply(scene.points_mm))
    return float((distance < _NEAR_MM).mean())


def _print(name: str, row: Row) -> None:
    per_bone = " ".join(
        f"{np.mean(np.array(errors) < _SUCCESS_MM):.2f}" for errors in row.by_bone.values()
    )
    silent = (
        f", {row.n_silent} silent, {row.n_unsaid} right but doubted"
        if row.n_silent or row.n_unsaid
        else ""
    )
    time_ms = f"{np.median(row.ms):.1f}, 95 % {np.percentile(row.ms, 95):.1f}"
    print(f"  {name:56s} {row.success:.3f} of {len(row.ms)} ({per_bone}) | {row.tre_mm:.3f} | "
          f"{time_ms}{silent}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()

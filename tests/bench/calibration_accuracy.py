"""Rigs solved from recorded pictures and from drawn marks, beside OpenCV's usual chain.

usage: python -m tests.bench.calibration_accuracy [FOLDER] [--rigs N]

FOLDER (default: NAVAPP_DATA) holds `phantom_*` folders with charuco pictures, the true rig and a
bone, and `calib/opencv_chessboard`. OpenCV's chain: corners refined by cornerSubPix, each camera
by calibrateCamera, then stereoCalibrate with these cameras held, or free, on the same pictures.

Bone: vertices of the femur that face the left camera in the registration frames, projected by the
true rig and triangulated by the solved one; no fit is removed, then one common shift.
Drawn rigs have corners with noise of 0.05 px and no pictures; their errors are those of points all
over the working volume, where a bone may be. Of the accepted ones the worst median, the worst 95 %
and the largest error are told, each over all of them.
"""

import argparse
import json
import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from calibration.rig.held_out_views import look_at_rig
from calibration.rig.rig_solution import Calibration, solve_rig
from calibration.targets.boards import Board, parse_board, read_board
from calibration.targets.detection import SeenBoard, find_board
from calibration.targets.seen_pairs import SeenPair
from drivers.recorded_sources import PictureFiles, open_folder
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import read_ply
from navapp.geometry.rectification import luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.triangulation import triangulate_mm
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pairs, drawn_rig
from tests.recorded import read_true_poses

_CHESSBOARD = {"type": "chessboard", "squares_x": 10, "squares_y": 7, "square_mm": 1.0}
_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-9)
# Half windows of cornerSubPix: markers stand near the corners of one of the boards.
_WINDOWS = {"charuco": 4, "chessboard": 5}
_WAYS = {"cameras held": cv2.CALIB_FIX_INTRINSIC, "all free": cv2.CALIB_USE_INTRINSIC_GUESS}
_FIRST_SEED = 4000


@dataclass(frozen=True)
class Pictures:
    """All pairs of a folder in which the board is seen, by our marks and by OpenCV's."""

    ours: list[SeenPair]
    opencv: list[SeenPair]
    size: tuple[int, int]


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--rigs", type=int, default=20)
    options = parser.parse_args()
    folder = Path(options.folder)
    print("| marks | detector | found | rms px | largest px | claimed px |")
    print("|---|" + "---|" * 5)
    for place in sorted(folder.glob("phantom_*/charuco")):
        marks(place.parent)
    print()
    print("| pictures | chain | pairs | stereo rms px | held-out rms px | baseline "
          "| bone median mm | after one shift mm | predicted 95 % mm |")  # fmt: skip
    print("|---|" + "---|" * 8)
    for place in sorted(folder.glob("phantom_*/charuco")):
        phantom(place.parent)
    board = folder / "calib" / "opencv_chessboard"
    if board.is_dir():
        pictures = looked_at(open_folder(board), parse_board(_CHESSBOARD))
        compare("opencv_chessboard", parse_board(_CHESSBOARD), pictures, None, None)
    drawn(options.rigs)
    return 0


def phantom(folder: Path) -> None:
    """Both chains on one phantom."""
    board = read_board(folder / "charuco" / "board.json")
    pictures = looked_at(open_folder(folder / "charuco"), board)
    aside = looked_at(open_folder(folder / "charuco_heldout"), board)
    compare(folder.name, board, pictures, aside, (read_rig(folder / "rig.yml"), bone(folder)))


def marks(folder: Path) -> None:
    """Found less true marks of one phantom, a coordinate, by both detectors."""
    board, rig = read_board(folder / "charuco" / "board.json"), read_rig(folder / "rig.yml")
    pictures = looked_at(open_folder(folder / "charuco"), board)
    truth = json.loads((folder / "charuco" / "truth.json").read_text())["poses"]
    poses = {one["index"]: np.array(one["T_leftcam_from_board"]) for one in truth}
    for name, pairs in (("navapp", pictures.ours), ("OpenCV", pictures.opencv)):
        off, claimed = [], []
        for pair in pairs:
            pose = RigidTransform("left", "board", poses[pair.index])
            for seen, camera, place in (
                (pair.left, rig.left, pose),
                (pair.right, rig.right, rig.right_from_left @ pose),
            ):
                off.append(seen.pixels - camera.project(place.apply(board.points_mm[seen.ids])))
                claimed.append(seen.sigma_px)
        errors = np.vstack(off)
        told = f"{np.median(np.concatenate(claimed)):.4f}" if name == "navapp" else "-"
        print(f"| {folder.name} | {name} | {len(errors)} | {np.sqrt(np.mean(errors**2)):.4f} "
              f"| {np.abs(errors).max():.3f} | {told} |", flush=True)  # fmt: skip


def looked_at(source: PictureFiles, board: Board) -> Pictures:
    """The board in every pair."""
    ours, theirs, size = [], [], (0, 0)
    for place, number in enumerate(source.numbers):
        grey = [luma(picture) for picture in source.load(place)]
        size = (grey[0].shape[1], grey[0].shape[0])
        left, right = (find_board(picture, board) for picture in grey)
        if left is None or right is None:
            continue
        ours.append(SeenPair(number, left, right))
        theirs.append(SeenPair(number, *(_by_opencv(p, board) for p in grey)))
    return Pictures(ours, theirs, size)


def _by_opencv(picture: np.ndarray, board: Board) -> SeenBoard:
    half = _WINDOWS[board.kind]
    if board.kind == "charuco":
        corners, ids, _, _ = cv2.aruco.CharucoDetector(board.charuco).detectBoard(picture)
    else:
        size = (board.columns - 1, board.rows - 1)
        _, corners = cv2.findChessboardCorners(picture, size)
        ids = np.arange(len(corners))
    flat = np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2).copy()
    pixels = cv2.cornerSubPix(picture, flat, (half, half), (-1, -1), _CRITERIA).reshape(-1, 2)
    ids = np.asarray(ids).reshape(-1)
    order = np.argsort(ids)
    pixels = pixels[order].astype(np.float64)
    return SeenBoard(ids[order], pixels, np.full(len(ids), 0.05), 0.6)


def usual_chain(
    board: Board, pairs: list[SeenPair], size: tuple[int, int], flags: int
) -> tuple[float, StereoRig]:
    """calibrateCamera twice, then stereoCalibrate: rms px, and the rig."""
    cameras = []
    for side in ("left", "right"):
        views = [getattr(pair, side) for pair in pairs]
        objects = [board.points_mm[view.ids].astype(np.float32) for view in views]
        pixels = [view.pixels.astype(np.float32) for view in views]
        solved = cv2.calibrateCamera(objects, pixels, size, None, None, criteria=_CRITERIA)
        cameras.append((solved[1], solved[2]))
    objects, left, right = [], [], []
    for pair in pairs:
        ids, a, b = pair.common()
        objects.append(board.points_mm[ids].astype(np.float32))
        left.append(a.astype(np.float32))
        right.append(b.astype(np.float32))
    (k1, d1), (k2, d2) = cameras
    rms, k1, d1, k2, d2, rotation, translation, *_ = cv2.stereoCalibrate(
        objects, left, right, k1, d1, k2, d2, size,
        flags=flags, criteria=_CRITERIA,
    )  # fmt: skip
    pose = RigidTransform.from_parts("right", "left", rotation, translation)
    rig = StereoRig(Camera(k1, d1.ravel()[:5], *size), Camera(k2, d2.ravel()[:5], *size), pose)
    return float(rms), rig


def compare(
    name: str,
    board: Board,
    pictures: Pictures,
    aside: Pictures | None,
    truth: tuple[StereoRig, FloatArray] | None,
) -> None:
    """One row a chain."""
    found = solve_rig(board, pictures.ours, pictures.size, aside=aside.ours if aside else ())
    _row(name, f"navapp ({found.solved.model.name})", len(found.pairs), found.solved.rms_px,
         f"{found.held_out_rms_px:.3f}", found.rig, truth, found)  # fmt: skip
    for way, flags in _WAYS.items():
        rms, rig = usual_chain(board, pictures.opencv, pictures.size, flags)
        held = "-" if aside is None else f"{look_at_rig(board, aside.opencv, rig):.3f}"
        _row(name, f"OpenCV, {way}", len(pictures.opencv), rms, held, rig, truth, None)


def _row(
    name: str,
    chain: str,
    n_pairs: int,
    rms_px: float,
    held: str,
    rig: StereoRig,
    truth: tuple[StereoRig, FloatArray] | None,
    found: Calibration | None,
) -> None:
    errors = ("-", "-")
    if truth is not None:
        off = off_mm(rig, *truth)
        rest = off - np.median(off, axis=0)
        errors = tuple(f"{np.median(np.linalg.norm(e, axis=1)):.3f}" for e in (off, rest))
    bound = f"{np.median(found.bounds_mm):.2f}" if found is not None and truth is not None else "-"
    print(f"| {name} | {chain} | {n_pairs} | {rms_px:.3f} | {held} | {rig.baseline_mm:.3f} "
          f"| {errors[0]} | {errors[1]} | {bound} |", flush=True)  # fmt: skip


def off_mm(solved: StereoRig, true: StereoRig, points_mm: FloatArray) -> FloatArray:
    """(n, 3) triangulated by the solved rig less true."""
    left = true.left.project(points_mm)
    right = true.right.project(true.right_from_left.apply(points_mm))
    return triangulate_mm(solved, left, right) - points_mm


def bone(folder: Path) -> FloatArray:
    """(n, 3) visible points of the femur in all registration frames, left camera."""
    mesh: TriangleMesh = read_ply(folder / "femur.ply")[0]
    points = []
    for pose in read_true_poses(folder / "registration").values():
        seen, normals = pose.apply(mesh.vertices_mm), pose.rotate(mesh.normals)
        is_facing = (seen * normals).sum(axis=1) < -0.2 * np.linalg.norm(seen, axis=1)
        points.append(seen[is_facing][::7])
    return np.vstack(points)


def drawn(n_rigs: int) -> None:
    """Rigs whose truth is known: does the prediction hold, and who is accepted?"""
    errors, bounds, accepted = [], [], []
    for seed in range(_FIRST_SEED, _FIRST_SEED + n_rigs):
        rng = np.random.default_rng(seed)
        true = drawn_rig(rng)
        n_pairs = int(rng.integers(8, 31))
        found = solve_rig(BOARD, drawn_pairs(true, rng, n_pairs), (WIDTH, HEIGHT))
        error = np.linalg.norm(off_mm(found.rig, true, found.points_mm), axis=1)
        errors.append(error)
        bounds.append(found.bounds_mm)
        if found.rig.quality is not None and found.rig.quality.is_accepted:
            accepted.append(np.quantile(error, (0.5, 0.95, 1.0)))
    worst = np.max(accepted, axis=0) if accepted else np.full(3, np.nan)
    all_errors, all_bounds = np.concatenate(errors), np.concatenate(bounds)
    print()
    print("| drawn rigs | error median mm | predicted 95 % median mm | ratio | holds | accepted "
          "| accepted, worst median mm | worst 95 % mm | largest mm |")  # fmt: skip
    print("|---|" + "---|" * 8)
    ratio = np.median(all_bounds) / np.median(all_errors)
    print(f"| {n_rigs} | {np.median(all_errors):.3f} | {np.median(all_bounds):.3f} | {ratio:.1f} "
          f"| {100 * np.mean(all_errors < all_bounds):.0f} % | {len(accepted)} "
          f"| {' | '.join(f'{one:.3f}' for one in worst)} |")  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())

"""Time from rectified pictures to the filled map with sigma, beside OpenCV's SGBM and WLS filter.

usage: python -m tests.bench.stereo_speed [--repetitions N]

On a simulated pair of 1280x720: the bone's box of 420x420 px with 96 disparities, and the whole
frame with 160. The peer is SGBM (three-way) for both views, and the contributed WLS filter where
the running OpenCV has it (`make bench-peers`). All take turns; medians of wall time, for one and
for two threads on both sides.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np

from navapp.geometry import Box, RectifiedPair, TriangleMesh
from navapp.geometry.zbuffer import render_rectified
from navapp.stereo import match_on_support, match_scene, match_surface
from tests.bench.bone_scenes import Scene, simulated_sequence
from tests.bench.occlusion_speed import median_ms, use_threads

_BOX_PX, _BOX_DISPARITIES, _FRAME_DISPARITIES = 420, 96, 160
_WINDOW_PX = 5
_WLS_LAMBDA, _WLS_SIGMA = 8000.0, 1.5
_REPETITIONS = 11


def main() -> None:
    """Print one line for each task, number of threads and chain."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=_REPETITIONS)
    repetitions = parser.parse_args().repetitions
    sequence = simulated_sequence("opening")
    scene, mesh = sequence.scenes[0], sequence.mesh
    peer = "SGBM + WLS" if hasattr(cv2, "ximgproc") else "SGBM alone"
    print(f"| task | threads | chain | ms | of {peer} |\n|---|---|---|---|---|")
    for name, chains in (("box", box_chains(scene, mesh)), ("frame", frame_chains(scene, mesh))):
        for n_threads in (1, 2):
            use_threads(n_threads)
            times = median_ms(chains, repetitions)
            for chain, ms in times.items():
                ratio = ms / times["peer"]
                print(f"| {name} | {n_threads} | {chain} | {ms:.1f} | {ratio:.2f} |", flush=True)


def box_chains(scene: Scene, mesh: TriangleMesh) -> dict[str, Callable[[], object]]:
    """Everything on the bone's box."""
    around = scene.pair.box
    x, y = around.x + around.width // 2, around.y + around.height // 2
    half = _BOX_PX // 2
    pair = replace(scene.pair, box=Box(x - half, y - half, _BOX_PX, _BOX_PX))
    middle = scene.pair.geometry.disparity_px(float(scene.pose.translation_mm[2]))
    lowest = int(middle) - _BOX_DISPARITIES // 2
    band = (float(lowest), float(lowest + _BOX_DISPARITIES - 1))

    def with_pose() -> object:
        geometry = pair.geometry
        depth_mm = render_rectified(mesh, scene.pose, geometry, pair.box).depth_mm
        return match_on_support(pair, geometry.disparity_map_px(depth_mm), fills=True)

    return {
        "with a pose": with_pose,
        "surface, no pose": lambda: match_surface(pair, band, fills=True),
        "scene, no pose": lambda: match_scene(pair, band, fills=True),
        "peer": peer_chain(pair, lowest, _BOX_DISPARITIES),
    }


def frame_chains(scene: Scene, mesh: TriangleMesh) -> dict[str, Callable[[], object]]:
    """Everything on the whole frame."""
    geometry = scene.pair.geometry
    pair = replace(scene.pair, box=Box(0, 0, geometry.width, geometry.height))
    deepest = geometry.disparity_px(float(scene.pose.apply(mesh.vertices_mm)[:, 2].max()) + 100.0)
    lowest = int(deepest)
    band = (float(lowest), float(lowest + _FRAME_DISPARITIES - 1))
    return {
        "surface, no pose": lambda: match_surface(pair, band, fills=True),
        "scene, no pose": lambda: match_scene(pair, band, fills=True),
        "peer": peer_chain(pair, lowest, _FRAME_DISPARITIES),
    }


def peer_chain(pair: RectifiedPair, lowest: int, count: int) -> Callable[[], object]:
    """SGBM for both views on the box and what its disparities reach, then the WLS filter."""
    box = pair.box
    lead = lowest + count
    rows, x0 = slice(box.y, box.y + box.height), max(box.x - lead, 0)
    left = np.ascontiguousarray(pair.left[rows, x0 : box.x + box.width])
    right = np.ascontiguousarray(pair.right[rows, x0 : box.x + box.width])
    # The right picture is moved: the peer need not search below the lowest disparity.
    right = np.roll(right, lowest, axis=1)
    start = box.x - x0 - count if box.x - x0 > count else 0
    left, right = (np.ascontiguousarray(image[:, start:]) for image in (left, right))
    both = {
        "numDisparities": count,
        "blockSize": _WINDOW_PX,
        "P1": 8 * _WINDOW_PX**2,
        "P2": 32 * _WINDOW_PX**2,
        "disp12MaxDiff": 1,
        "preFilterCap": 63,
        "mode": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    }
    forward = cv2.StereoSGBM.create(minDisparity=0, **both)
    backward = cv2.StereoSGBM.create(minDisparity=1 - count, **both)
    wls = None
    if hasattr(cv2, "ximgproc"):
        wls = cv2.ximgproc.createDisparityWLSFilter(forward)
        wls.setLambda(_WLS_LAMBDA)
        wls.setSigmaColor(_WLS_SIGMA)

    def run() -> object:
        found = forward.compute(left, right)
        other = backward.compute(right, left)
        return found if wls is None else wls.filter(found, left, None, other)

    return run


if __name__ == "__main__":
    main()

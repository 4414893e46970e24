"""`navapp stereo`: the disparity of one pair."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.compiling import run_compiled
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.cli.stereo_pair import StereoPair, find_band, read_pair, render_expected_px
from navapp.errors import ResultError, UsageError

if TYPE_CHECKING:
    from navapp.stereo.chains import StereoAnswer

_METRIC_GAP_PX = 40

_EXAMPLE = """\
examples:
  navapp stereo left.png right.png --disparities 64 --out disparity.npy --picture disparity.png
  navapp stereo left.jpg right.jpg --rig rig.yml --cloud cloud.ply
  navapp stereo left.jpg right.jpg --rig rig.yml --model femur.ply --pose pose.json --out d.npy
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "stereo",
        help="the disparity of one pair of pictures",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("left", metavar="LEFT", help="left picture")
    parser.add_argument("right", metavar="RIGHT", help="right picture")
    parser.add_argument("--rig", metavar="R", help="rig file; without it the pair is rectified")
    parser.add_argument("--model", metavar="M.ply", help="expected surface (with --pose and --rig)")
    parser.add_argument("--pose", metavar="T.json", help="camera_from_model of that surface")
    parser.add_argument("--disparities", type=int, metavar="N", help="how many are searched")
    parser.add_argument("--min-disparity", type=int, metavar="M", help="the smallest (default 0)")
    parser.add_argument(
        "--matcher",
        choices=("gradient", "production"),
        default="production",
        help="gradient is the paper's baseline",
    )
    parser.add_argument(
        "--fill",
        choices=("none", "wls"),
        help="of occlusions (wls; with --matcher gradient none: with wls it is the proposal's)",
    )
    parser.add_argument("--out", metavar="D.npy", help="float32 disparity px, NaN unknown")
    parser.add_argument("--sigma", metavar="S.npy", help="float32 standard deviation px")
    parser.add_argument("--origin", metavar="O.png", help="where each disparity comes from")
    parser.add_argument("--picture", metavar="D.png", help="disparity in colours, filled hatched")
    parser.add_argument("--cloud", metavar="C.ply", help="points in the left camera, mm")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Match the pair, write what was asked for; the exit code."""
    _check(options)

    def match() -> tuple[StereoPair, "StereoAnswer"]:
        pair = read_pair(options)
        return pair, _match(pair, options)

    pair, answer = run_compiled(match, diagnostics)
    answer = replace(answer, timings=replace(answer.timings, rectify_ms=pair.rectify_ms))
    _write(pair, answer, options)
    content = _content(pair, answer)
    write_json(options.json, "stereo", content)
    if options.json != "-":
        diagnostics.say(
            f"{content['width']}x{content['height']}: {100 * content['density_matched']:.1f} % "
            f"matched, {100 * content['density_filled']:.1f} % with the fill, "
            f"{answer.timings.total_ms:.0f} ms"
        )
    files = (options.out, options.sigma, options.origin, options.picture, options.cloud)
    if not any((*files, options.json)):
        diagnostics.warn("nothing is saved: name a file with --out, --picture or --cloud")
    for reason in answer.reasons:
        diagnostics.warn(reason)
    if content["density_matched"] == 0.0:
        why = answer.reasons[0] if answer.reasons else "nothing was matched"
        raise ResultError(why, remedy="check the pictures, their order and the disparity range")
    return 0


def _check(options: argparse.Namespace) -> None:
    if bool(options.model) != bool(options.pose):
        raise UsageError("--model and --pose belong together", remedy="give both or neither")
    if options.model and not options.rig:
        raise UsageError("--model needs --rig", remedy="add the rig that took the pictures")
    if options.model and (options.matcher == "gradient" or options.disparities is not None):
        raise UsageError(
            "--model says where to match and how",
            remedy="leave --matcher gradient and --disparities away, or --model and --pose",
        )
    if options.min_disparity is not None and options.disparities is None:
        raise UsageError("--min-disparity needs --disparities", remedy="give both or neither")
    if options.cloud and not options.rig:
        raise UsageError("--cloud needs --rig", remedy="a pair without a rig has no lengths")
    if options.disparities is None and not options.rig:
        raise UsageError("no disparity range is known", remedy="give --disparities or --rig")
    if options.disparities is not None and options.disparities < 2:
        raise UsageError("--disparities must be at least 2", remedy="64 suits many pairs")
    for path in (options.out, options.sigma, options.origin, options.picture, options.cloud):
        check_writable(path)
    check_writable(options.json)


def _match(pair: StereoPair, options: argparse.Namespace) -> "StereoAnswer":
    from navapp.stereo import (
        match_baseline,
        match_on_support,
        match_scene,
        match_surface,
    )

    is_baseline = options.matcher == "gradient"
    fills = options.fill == "wls" or (options.fill is None and not is_baseline)
    if options.model:
        return match_on_support(
            pair.rectified,
            render_expected_px(pair, options),
            fills=fills,
            max_gap_px=_METRIC_GAP_PX,
        )
    band = find_band(pair, options)
    try:
        if is_baseline:
            return match_baseline(pair.rectified, band, fills=fills)
        if options.rig is None:
            return match_scene(pair.rectified, band, fills=fills)
        # Of a rig's pictures lengths are taken: what is far from anything measured stays unknown.
        return match_surface(pair.rectified, band, fills=fills, max_gap_px=_METRIC_GAP_PX)
    except ValueError as error:
        # The matchers' own limits: too many disparities, or too much memory.
        raise UsageError(str(error), remedy="ask for fewer --disparities") from error


def _write(pair: StereoPair, answer: "StereoAnswer", options: argparse.Namespace) -> None:
    """Every file that was asked for."""
    import io

    import cv2

    from navapp.cli.stereo_files import draw_disparity, make_cloud_ply
    from navapp.geometry.whole_files import write_whole

    found = answer.disparity
    for path, values in ((options.out, found.disparity_px), (options.sigma, found.sigma_px)):
        if path:
            buffer = io.BytesIO()
            np.save(buffer, values.astype(np.float32))
            write_whole(path, buffer.getvalue())
    for path, image in ((options.origin, found.origin), (options.picture, None)):
        if path:
            shown = draw_disparity(found) if image is None else image
            write_whole(path, cv2.imencode(".png", shown)[1].tobytes())
    if options.cloud:
        write_whole(options.cloud, make_cloud_ply(found, pair.rectified.geometry))


def _content(pair: StereoPair, answer: "StereoAnswer") -> dict[str, Any]:
    from navapp.values import Origin

    origin = answer.disparity.origin
    sigma = answer.disparity.sigma_px[origin == Origin.MATCHED]
    rectified = None
    if pair.rectifier is not None:
        r1, _, p1, p2 = pair.rectifier.matrices
        rectified = {"R1": r1.tolist(), "P1": p1.tolist(), "P2": p2.tolist()}
    timings = answer.timings
    return {
        "width": origin.shape[1],
        "height": origin.shape[0],
        "rectified": rectified,
        "density_matched": float((origin == Origin.MATCHED).mean()),
        "density_filled": float((origin != Origin.UNKNOWN).mean()),
        "filled_border": int((origin == Origin.FILLED_BORDER).sum()),
        "filled_interior": int((origin == Origin.FILLED_INTERIOR).sum()),
        "median_sigma_px": float(np.median(sigma)) if sigma.size else None,
        "timing_ms": {
            "rectify": timings.rectify_ms,
            "stereo": timings.stereo_ms,
            "fill": timings.fill_ms,
            "total": timings.total_ms,
        },
        "reasons": list(answer.reasons),
    }

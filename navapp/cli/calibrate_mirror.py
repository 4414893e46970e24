"""`navapp calibrate mirror`: the display in the mirror, from views or from aligned crosses."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from navapp.cli.alignment_files import read_alignments
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.cli.display_record import DisplayRecord, read_record
from navapp.cli.mirror_by_keys import align_by_keys, check_options
from navapp.cli.mirror_options import (
    USUAL_GLASS_DEG,
    USUAL_GLASS_MM,
    choose_source,
    find_pitch_mm,
)
from navapp.cli.mirror_views import read_lens, read_views
from navapp.errors import ResultError, UsageError

if TYPE_CHECKING:
    from calibration.mirror.alignment_fit import Alignments
    from calibration.mirror.alignment_start import AlignedDisplay
    from navapp.config import Configuration
    from navapp.geometry.display_model import DisplayModel

# Those of `DisplayModel`, which takes long to import.
_EYES = ("left", "right", "camera")
_EXAMPLE = """\
examples:
  navapp calibrate mirror --pattern pattern.png --size 1920x1080 --board board.json
  navapp calibrate mirror --out display.yml --views views/ --board board.json --rig rig.yml \\
      --size 1920x1080 --diagonal-inch 24 --report display.html
  navapp calibrate mirror --out display.yml --board board.json --by-keys     the simulated room
  navapp --config mine.toml calibrate mirror --out display.yml --board board.json --by-keys \\
      --rig rig.yml --diagonal-inch 24 --viewing-eye right
  navapp calibrate mirror --out display.yml --board board.json --by-keys --headless
  navapp calibrate mirror --out display.yml --alignments display.alignments.json

By keys, the eye that looks moves one cross after the other onto the corner of the board that the
screen names, with the arrow keys, and confirms it with ENTER; 12 alignments at three depths over
60 mm are needed. They are kept beside the display's file, for --alignments. Without a screen a
simulated eye aligns them.

The folder of --views holds, for every view, eye_site_0000.png and eye_screen_0000.png of the
camera at the eye's place (the board at the site with the display dark; the pattern on the
display), and left_0000.png and right_0000.png of the stereo cameras (docs/calibration.md, The
mirror).
"""


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "mirror",
        help="solve the display in the mirror, and judge it",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", metavar="DISPLAY.yml", help="display file to write")
    parser.add_argument("--views", metavar="DIR", help="views of a camera at the eye's place")
    parser.add_argument("--alignments", metavar="FILE.json", help="crosses that an eye aligned")
    parser.add_argument(
        "--by-keys", action="store_true", help="align crosses now, with the arrow keys"
    )
    parser.add_argument(
        "--headless", action="store_true", help="no screen; a simulated eye aligns the crosses"
    )
    parser.add_argument(
        "--save-alignments", metavar="FILE.json",
        help="keep those made by keys here, also when they are too few (DISPLAY.alignments.json)",
    )  # fmt: skip
    parser.add_argument(
        "--upside-down", action="store_true",
        help="by keys: the eye reads what the display shows on its head",
    )  # fmt: skip
    parser.add_argument("--pattern", metavar="FILE.png", help="write what the display must show")
    parser.add_argument("--board", metavar="BOARD.json", help="what is at the site")
    parser.add_argument(
        "--rig", metavar="R", help="stereo rig that takes left and right (by keys: [camera] rig)"
    )
    parser.add_argument("--size", metavar="WxH", help="of the display ([display] size_px)")
    parser.add_argument("--diagonal-inch", type=float, metavar="D", help="of the display")
    parser.add_argument("--glass-mm", type=float, metavar="T", help="of the plate (3)")
    parser.add_argument(
        "--glass-deg", type=float, metavar="A",
        help="between the plate's normal and the line of sight, the display above (45)",
    )  # fmt: skip
    parser.add_argument("--curved", action="store_true", help="solve for the panel's bulge")
    parser.add_argument("--lens", metavar="FILE", help="of the eye's camera, calibrated")
    parser.add_argument(
        "--eye-views", default="", metavar="N,...",
        help="views whose camera stood where the eye will be (those within 5 mm of the first)",
    )  # fmt: skip
    parser.add_argument(
        "--viewing-eye", choices=_EYES, help="of the views (camera), or that aligns (right)"
    )
    parser.add_argument("--report", metavar="R.html", help="what a person needs to trust it")
    parser.add_argument("--force", action="store_true", help="write what is not accepted")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Solve, judge, write; the exit code."""
    from navapp.config import find_file, load
    from navapp.geometry.display_model_files import write_display_model

    for path in (options.out, options.report, options.json, options.pattern):
        check_writable(path)
    source = choose_source(options)
    configuration = load(find_file(options.config))
    if source == "pattern":
        return _write_pattern(options, configuration)
    if source == "by_keys":
        check_options(options, configuration)
    record = read_record(configuration)
    if source == "views":
        model, content = _solve_views(options, configuration, record, diagnostics)
    elif source == "alignments":
        made = read_alignments(options.alignments)
        model, content = _solve_made(*made, options, record, diagnostics)
    else:
        aligned = align_by_keys(options, configuration, diagnostics)
        if isinstance(aligned, int):
            return aligned
        model, content = _solve_made(*aligned, options, record, diagnostics)
    if content.get("advice"):
        diagnostics.warn(content["advice"])
    model = record.add_to(model)
    is_accepted = model.quality is not None and model.quality.is_accepted
    if is_accepted or options.force:
        write_display_model(options.out, model)
    write_json(options.json, "calibrate mirror", {**_content(model), **content})
    if options.json != "-":
        _tell(model, diagnostics)
    return 0 if is_accepted else _refuse(model, options)


def _refuse(model: "DisplayModel", options: argparse.Namespace) -> int:
    written = "written as not accepted" if options.force else "not written"
    reasons = () if model.quality is None else model.quality.reasons
    raise ResultError(
        f"the display is not accepted: {'; '.join(reasons)}",
        subject=options.out,
        remedy=f"{options.out} is {written}; take more views or alignments",
    )


def _write_pattern(options: argparse.Namespace, configuration: "Configuration") -> int:
    import cv2

    from calibration.mirror.screen_pattern import make_pattern
    from calibration.targets.boards import read_board
    from navapp.geometry.whole_files import write_whole

    board = None if options.board is None else read_board(options.board)
    picture = make_pattern(*_display_size(options, configuration), board).draw()
    write_whole(options.pattern, cv2.imencode(".png", picture)[1].tobytes())
    return 0


def _solve_views(
    options: argparse.Namespace,
    configuration: "Configuration",
    record: DisplayRecord,
    diagnostics: Diagnostics,
) -> "tuple[DisplayModel, dict[str, Any]]":
    """From the pictures of a folder."""
    from calibration.mirror.display_acceptance import DisplayLimits
    from calibration.mirror.display_solution import solve_display
    from calibration.mirror.first_state import Told
    from calibration.targets.boards import read_board
    from navapp.geometry.rig_files import read_rig

    if options.board is None or options.rig is None:
        raise UsageError(
            "--views needs the board and the rig that its pictures show",
            remedy="give --board BOARD.json and --rig R",
        )
    rig, board = read_rig(options.rig), read_board(options.board)
    size = _display_size(options, configuration)
    scene, seen, dropped = read_views(
        options.views, board, rig, size, _eye_views(options.eye_views), diagnostics
    )
    lens = None if options.lens is None else read_lens(options.lens, scene.eye_size)
    limits = DisplayLimits()
    glass_mm = USUAL_GLASS_MM if options.glass_mm is None else options.glass_mm
    glass_deg = USUAL_GLASS_DEG if options.glass_deg is None else options.glass_deg
    found = solve_display(
        scene, seen, Told(find_pitch_mm(options, size), glass_mm, glass_deg),
        lens=lens, with_bulge=options.curved, limits=limits,
        on_progress=lambda share: diagnostics.progress("solving", share),
    )  # fmt: skip
    found = replace(found, dropped=sorted([*dropped, *found.dropped], key=lambda one: one.index))
    model = replace(found.model, viewing_eye=options.viewing_eye or "camera")
    if options.report:
        from calibration.report.display_report import write_view_report

        named = replace(found, model=record.add_to(model))
        write_view_report(options.report, named, limits)
    content = {
        "views_used": len(found.views),
        "views_dropped": [{"index": one.index, "reason": one.reason} for one in found.dropped],
    }
    return model, content


def _solve_made(
    display: "AlignedDisplay",
    made: "Alignments",
    options: argparse.Namespace,
    record: DisplayRecord,
    diagnostics: Diagnostics,
) -> "tuple[DisplayModel, dict[str, Any]]":
    """From crosses that an eye aligned."""
    from calibration.mirror.alignments import advise, solve_alignments

    found = solve_alignments(display, made)
    if options.report:
        from calibration.report.display_report import write_alignment_report

        named = replace(found, model=record.add_to(found.model))
        write_alignment_report(options.report, named, display.reading)
    if options.json != "-":
        diagnostics.say(f"the eye reads the display {display.reading}: told, not measured")
    return found.model, {
        "alignments_used": int(found.is_used.sum()),
        "alignments_dropped": [int(k) for k, used in enumerate(found.is_used) if not used],
        "alignment_sd_px": found.alignment_sd_px,
        # Nothing in the alignments tells it.
        "reads_upside_down_as_told": display.reads_upside_down,
        "advice": advise(found, len(made.pixels)),
    }


def _display_size(options: argparse.Namespace, configuration: "Configuration") -> tuple[int, int]:
    if options.size is None:
        if configuration.display.size_px is not None:
            return configuration.display.size_px
        raise UsageError(
            "the size of the display is not known",
            remedy="give --size WxH, or [display] size_px in the configuration",
        )
    width, cross, height = options.size.lower().partition("x")
    if not (cross and width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise UsageError(
            f"--size {options.size} is no size", remedy="give it in px, such as 1920x1080"
        )
    return int(width), int(height)


def _eye_views(text: str) -> set[int]:
    try:
        return {int(part) for part in text.split(",") if part.strip()}
    except ValueError:
        raise UsageError(
            f"--eye-views {text} names no views", remedy="give their numbers, such as 0,2,4"
        ) from None


def _content(model: "DisplayModel") -> dict[str, Any]:
    quality = model.quality
    assert quality is not None  # noqa: S101 (for the type checker: it always has one)
    return {
        "accepted": quality.is_accepted,
        "reasons": list(quality.reasons),
        "error_mm": quality.error_mm,
        "error_arcmin": quality.error_arcmin,
        "figures": dict(quality.figures),
        "eye_mm": model.eye_mm.tolist(),
        "viewing_eye": model.viewing_eye,
        "screen_middle_mm": model.screen.middle_mm.tolist(),
        "pitch_mm": model.screen.pitch_mm,
        "flips": {"columns": model.flips_columns, "rows": model.flips_rows},
    }


def _tell(model: "DisplayModel", diagnostics: Diagnostics) -> None:
    quality = model.quality
    assert quality is not None  # noqa: S101 (for the type checker: it always has one)
    if "held_out_mm" in quality.figures:
        diagnostics.say(
            f"{quality.figures['views_used']:.0f} views: guides appear within "
            f"{quality.figures['held_out_mm']:.2f} mm ({quality.figures['held_out_arcmin']:.1f} "
            "arcmin) of their points on held-out views, 95 %"
        )
    eye = ", ".join(f"{value:.0f}" for value in model.eye_mm)
    diagnostics.say(
        f"predicted 95 % error at the anatomy {quality.error_mm:.2f} mm "
        f"({quality.error_arcmin:.1f} arcmin), seen from {eye} mm in the left "
        "camera's frame"
    )  # fmt: skip

"""`navapp calibrate check --display`: does the display in the mirror still hold?"""

import argparse
from dataclasses import replace
from datetime import date

from navapp.cli.diagnostics import Diagnostics, write_json
from navapp.cli.mirror_views import read_lens, read_views
from navapp.errors import ResultError, UsageError
from navapp.geometry.display_model import DisplayModel


def check_mirror(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Judge a display by new views; the exit code."""
    from calibration.mirror.display_check import check_display
    from calibration.targets.boards import read_board
    from navapp.geometry.display_model_files import read_display_model
    from navapp.geometry.rig_files import read_rig

    if None in (options.display, options.views, options.views_rig) or options.rig is not None:
        raise UsageError(
            "the check of a display needs its file, views, and the rig that took them",
            remedy="give --display DISPLAY.yml --views DIR --rig R, and no RIG before them",
        )
    model, rig = read_display_model(options.display), read_rig(options.views_rig)
    size = (model.screen.width_px, model.screen.height_px)
    scene, seen, _ = read_views(
        options.views, read_board(options.board), rig, size, set(), diagnostics
    )
    lens = None if options.lens is None else read_lens(options.lens, scene.eye_size)
    found = check_display(scene, seen, model, lens)
    found = replace(found, reasons=(*_of_record(model), *found.reasons))
    content = {
        "accepted": not found.reasons,
        "reasons": list(found.reasons),
        "error_mm": found.error_mm,
        "error_arcmin": found.error_arcmin,
        "views_used": found.n_views,
    }
    write_json(options.json, "calibrate check", content)
    if found.reasons:
        raise ResultError(
            f"the display does not pass: {'; '.join(found.reasons)}",
            subject=options.display,
            remedy="calibrate the mirror again",
        )
    if options.json != "-":
        diagnostics.say(
            f"the display still holds: guides appear within {found.error_mm:.2f} mm "
            f"({found.error_arcmin:.1f} arcmin) of their points in {found.n_views} views, 95 %"
        )
    return 0


def _of_record(model: DisplayModel) -> tuple[str, ...]:
    """What the display's own file says against it."""
    quality = model.quality
    if quality is None:
        return ()
    reasons = [] if quality.is_accepted else ["its calibration was not accepted"]
    if quality.has_expired(date.today()):
        reasons.append(f"it expired on {quality.expires_on}")
    return tuple(reasons)

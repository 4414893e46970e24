"""What a solved display is worth on views that it was not solved with, in mm at the anatomy."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibration.mirror.first_state import Told, make_first_state
from calibration.mirror.seen_views import Scene, SeenView, gather
from calibration.mirror.view_bundle import Bundle, Priors, solve
from calibration.mirror.view_state import ViewState, on_board_mm, predict
from navapp.geometry.camera import Camera
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.display_model_optics import Glass
from navapp.geometry.transform import FloatArray

N_FOLDS = 4
_SITE_KINDS = ("eye_site", "left", "right")
_REACH = 1.1


@dataclass(frozen=True, slots=True, eq=False)
class ViewErrors:
    """How far what is drawn at the site appears from where it should, over all its marks."""

    mm: FloatArray  # (n,) at the board's distance, perpendicular to the line of sight
    arcmin: FloatArray  # (n,) as the eye sees it
    view: FloatArray  # (n,) number of the view

    def quantile(self, share: float) -> tuple[float, float]:
        """In mm and arcmin; NaN of none."""
        if len(self.mm) == 0:
            return float("nan"), float("nan")
        return float(np.quantile(self.mm, share)), float(np.quantile(self.arcmin, share))


def hold_out(
    scene: Scene,
    views: list[SeenView],
    whole: Bundle,
    priors: Priors,
    on_fold: Callable[[], None] = lambda: None,
) -> ViewErrors:
    """Solve without each fold of the views in turn, and look at that fold.

    Args:
        scene: what all views have in common.
        views: V of them.
        whole: solved with all of them; where each solve begins.
        priors: of the shared numbers.
        on_fold: told when one is done.
    """
    parts = []
    for fold in range(min(N_FOLDS, len(views))):
        is_out = np.arange(len(views)) % N_FOLDS == fold
        kept = [view for view, out in zip(views, is_out, strict=True) if not out]
        solved = solve(gather(scene, kept), scene.rig, whole.state.only(~is_out), priors)
        aside = [view for view, out in zip(views, is_out, strict=True) if out]
        start = _with_shared(whole.state.only(is_out), solved.state)
        parts.append(look_at(scene, aside, start, priors))
        on_fold()
    return _join(parts)


def look_at(scene: Scene, views: list[SeenView], start: ViewState, priors: Priors) -> ViewErrors:
    """Errors of views under shared numbers that stay as they are.

    Where the camera stood, the board at the site tells alone; where the pattern is then expected
    is compared with where it is seen, as far as the board reaches.
    """
    marks = gather(scene, views)
    posed = solve(marks, scene.rig, start, priors, shared_held=True, kinds=_SITE_KINDS).state
    table = {"eye_screen": marks["eye_screen"]}
    off = table["eye_screen"].pixels - predict(posed, table, scene.rig)["eye_screen"]
    angles = np.linalg.norm(off / posed.lens[:2], axis=1)
    mm, arcmin, numbers = [], [], []
    for k, view in enumerate(views):
        rows = marks["eye_site"].view == k
        points = on_board_mm(posed, marks["eye_site"])[rows]
        distance = np.linalg.norm(points - posed.centres_mm[k], axis=1).mean()
        middle = view.eye_site.pixels.mean(axis=0)
        reach = np.linalg.norm(view.eye_site.pixels - middle, axis=1).max()
        seen = np.linalg.norm(view.eye_screen.pixels - middle, axis=1) <= _REACH * reach
        angle = angles[table["eye_screen"].view == k][seen]
        mm.append(distance * angle)
        arcmin.append(60.0 * np.degrees(angle))
        numbers.append(np.full(len(angle), view.index))
    return ViewErrors(np.concatenate(mm), np.concatenate(arcmin), np.concatenate(numbers))


def look_with(
    scene: Scene, views: list[SeenView], model: DisplayModel, lens: Camera | None
) -> ViewErrors:
    """Errors of new views under a display as its file has it; the eye's camera is solved anew."""
    first = make_first_state(scene, views, Told(model.screen.pitch_mm), lens)
    glass = model.glass or Glass(0.0, first.glass.normal)
    start = ViewState(
        first.lens, model.screen, glass, first.eye_turn, first.eye_shift,
        first.board_turn, first.board_shift,
    )  # fmt: skip
    priors = Priors(start, has_lens=lens is not None, has_screen=True)
    # A lens that shows board and pattern side by side cannot hide that one of them has moved.
    posed = solve(gather(scene, views), scene.rig, start, priors).state
    return look_at(scene, views, posed, priors)


def _with_shared(views: ViewState, shared: ViewState) -> ViewState:
    return ViewState(
        shared.lens, shared.screen, shared.glass, views.eye_turn, views.eye_shift,
        views.board_turn, views.board_shift,
    )  # fmt: skip


def _join(parts: list[ViewErrors]) -> ViewErrors:
    return ViewErrors(
        np.concatenate([one.mm for one in parts]),
        np.concatenate([one.arcmin for one in parts]),
        np.concatenate([one.view for one in parts]),
    )

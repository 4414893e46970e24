"""The display in a mirror from views of a camera at the eye's place."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calibration.mirror.display_acceptance import DisplayLimits, Found, judge
from calibration.mirror.first_state import Told, make_first_state
from calibration.mirror.seen_views import DroppedView, Scene, SeenView, gather
from calibration.mirror.view_bundle import Bundle, Priors, solve
from calibration.mirror.view_errors import N_FOLDS, ViewErrors, hold_out
from calibration.mirror.view_state import N_SHARED, N_VIEW, ViewState, on_board_mm
from navapp.errors import ResultError
from navapp.geometry.camera import Camera
from navapp.geometry.display_model import N_PARAMETERS, DisplayModel, DisplayQuality
from navapp.geometry.transform import FloatArray, nearest_rotation

_FEWEST = 3
# Views whose camera stood as near to the first one belong to the same eye.
_SAME_EYE_MM = 5.0
_WORST_VIEW, _MOST_DROPPED, _WORST_RMS_PX = 4.0, 0.4, 0.5
_N_ANATOMY, _BULGE_SD_MM = 200, 20.0


@dataclass(frozen=True, slots=True, eq=False)
class DisplayCalibration:
    """A solved display and all that is known of it."""

    scene: Scene
    views: list[SeenView]  # that are used
    dropped: list[DroppedView]
    solved: Bundle
    model: DisplayModel
    held_out: ViewErrors
    anatomy_mm: FloatArray  # (n, 3) marks at the site, where errors are judged
    predicted_mm: FloatArray  # (n,) 95 % error at each of them

    @property
    def rms_px(self) -> float:
        """Of all residuals."""
        squares = np.concatenate(
            [(part**2).sum(axis=1) for part in self.solved.residuals_px.values()]
        )
        return float(np.sqrt(squares.mean()))


def solve_display(
    scene: Scene,
    views: list[SeenView],
    told: Told,
    *,
    lens: Camera | None = None,
    with_bulge: bool = False,
    limits: DisplayLimits | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> DisplayCalibration:
    """Solve screen, glass, eye and the eye's camera, and judge them on held-out views.

    Args:
        scene: what all views have in common.
        views: three at least.
        told: of the set-up.
        lens: of the eye's camera; None: solved for.
        with_bulge: the panel may be curved.
        limits: that must be met to be accepted.
        on_progress: told the share that is done.

    Raises:
        ResultError: too few views, or views that tell nothing.
    """
    if len(views) < _FEWEST:
        raise ResultError(
            f"only {len(views)} views show board and pattern, {_FEWEST} are the least",
            remedy="show the board at the site to all three cameras, the pattern to the eye's",
        )
    views, mixed = _of_one_handedness(views)
    first = make_first_state(scene, views, told, lens)
    priors = _make_priors(first, told, with_bulge, lens is not None)
    solved, views, dropped = _solve_without_strays(scene, views, first, priors)
    on_progress(0.3)
    done = iter(range(1, N_FOLDS + 1))
    held_out = hold_out(
        scene, views, solved, priors, lambda: on_progress(0.3 + 0.7 * next(done) / N_FOLDS)
    )
    model = _make_model(views, solved)
    return _judged(
        scene, views, [*mixed, *dropped], solved, model, held_out, limits or DisplayLimits()
    )


def _make_priors(first: ViewState, told: Told, with_bulge: bool, has_lens: bool) -> Priors:
    """What is known before any view."""
    priors = Priors(first, bulge_sd_mm=_BULGE_SD_MM * with_bulge, has_lens=has_lens)
    return priors if told.pitch_mm is not None else replace(priors, pitch_sd_share=np.inf)


def _of_one_handedness(views: list[SeenView]) -> tuple[list[SeenView], list[DroppedView]]:
    """Without views that show the pattern the other way round than most."""
    n_mirrored = sum(view.is_mirrored for view in views)
    is_mirrored = 2 * n_mirrored > len(views)
    reason = "the pattern is seen the other way round than in the other views"
    return (
        [view for view in views if view.is_mirrored == is_mirrored],
        [DroppedView(view.index, reason) for view in views if view.is_mirrored != is_mirrored],
    )


def _solve_without_strays(
    scene: Scene, views: list[SeenView], first: ViewState, priors: Priors
) -> tuple[Bundle, list[SeenView], list[DroppedView]]:
    """Solve; as long as one view fits far worse than the others, without it again."""
    dropped: list[DroppedView] = []
    solved = solve(gather(scene, views), scene.rig, first, priors)
    most = int(_MOST_DROPPED * len(views))
    while len(dropped) < most and len(views) > _FEWEST:
        rms = _rms_by_view(scene, views, solved)
        worst = int(np.argmax(rms))
        usual = float(np.median(rms))
        if rms[worst] <= max(_WORST_VIEW * usual, _WORST_RMS_PX):
            break
        dropped.append(
            DroppedView(
                views[worst].index,
                f"its marks are off by {rms[worst]:.2f} px rms, those of the others by "
                f"{usual:.2f} px: something moved between its pictures",
            )
        )
        kept = np.arange(len(views)) != worst
        views = [view for view, keep in zip(views, kept, strict=True) if keep]
        solved = solve(gather(scene, views), scene.rig, solved.state.only(kept), priors)
    return solved, views, dropped


def _rms_by_view(scene: Scene, views: list[SeenView], solved: Bundle) -> FloatArray:
    """(V,) of the residuals of the kind of marks that fits worst."""
    marks = gather(scene, views)
    rms = np.zeros((len(marks), len(views)))
    for row, (kind, table) in enumerate(marks.items()):
        squares = (solved.residuals_px[kind] ** 2).sum(axis=1)
        for k in range(len(views)):
            rms[row, k] = np.sqrt(np.mean(squares[table.view == k]))
    worst: FloatArray = rms.max(axis=0)
    return worst


def _eye_views(views: list[SeenView], centres_mm: FloatArray) -> FloatArray:
    """(V,) weights of the views whose camera's centre is the eye's."""
    marked = np.array([view.is_eye for view in views])
    if not marked.any():
        marked = np.linalg.norm(centres_mm - centres_mm[0], axis=1) <= _SAME_EYE_MM
    weights: FloatArray = marked / marked.sum()
    return weights


def _make_model(views: list[SeenView], solved: Bundle) -> DisplayModel:
    """The solved display with the covariance of its numbers."""
    state = solved.state
    weights = _eye_views(views, state.centres_mm)
    right, below, _ = nearest_rotation(state.eye_turn.mean(axis=0))
    across, down = state.screen.across, state.screen.down
    is_mirrored = views[0].is_mirrored
    # Of the two ways that go with the handedness, the one that is more nearly upright.
    ways = [(True, False), (False, True)] if is_mirrored else [(False, False), (True, True)]
    upright = [
        (-1 if columns else 1) * float(across @ right) + (-1 if rows else 1) * float(down @ below)
        for columns, rows in ways
    ]
    flips = ways[int(np.argmax(upright))]
    eye = weights @ state.centres_mm
    return DisplayModel(
        state.screen, state.glass, eye, *flips,
        quality=DisplayQuality(False, covariance=_covariance(solved, weights)),
    )  # fmt: skip


def _covariance(solved: Bundle, weights: FloatArray) -> FloatArray:
    """(14, 14) of the numbers of `DisplayModel.move`."""
    state = solved.state
    n_views = len(weights)
    slopes = np.zeros((N_PARAMETERS, N_SHARED + N_VIEW * n_views))
    slopes[:11, 8:N_SHARED] = np.eye(11)
    for k in range(n_views):
        # The centre is -R' t: turned by a small w, then shifted by s, it moves by -R' s.
        at = N_SHARED + N_VIEW * k + 3
        slopes[11:, at : at + 3] = -weights[k] * state.eye_turn[k].T
    slopes = slopes[:, solved.is_free]
    covariance: FloatArray = slopes @ solved.covariance @ slopes.T
    return covariance


def _thin_out(points_mm: FloatArray) -> FloatArray:
    """Some of the points (n, 3), evenly."""
    return points_mm[:: max(1, len(points_mm) // _N_ANATOMY)]


def _judged(
    scene: Scene,
    views: list[SeenView],
    dropped: list[DroppedView],
    solved: Bundle,
    model: DisplayModel,
    held_out: ViewErrors,
    limits: DisplayLimits,
) -> DisplayCalibration:
    """With its verdict."""
    anatomy = _thin_out(on_board_mm(solved.state, gather(scene, views)["eye_site"]))
    predicted = model.predict_error(anatomy)
    distances = np.linalg.norm(anatomy - model.eye_mm, axis=1)
    error_mm = float(np.quantile(predicted, 0.95))
    error_arcmin = float(60.0 * np.degrees(np.quantile(predicted / distances, 0.95)))
    calibration = DisplayCalibration(
        scene, views, dropped, solved, model, held_out, anatomy, predicted
    )
    held_mm, held_arcmin = held_out.quantile(0.95)
    found = Found(
        len(views), solved.is_settled, calibration.rms_px, held_mm, held_arcmin, error_mm,
        error_arcmin,
    )  # fmt: skip
    reasons = judge(found, limits)
    assert model.quality is not None  # noqa: S101 (for the type checker: it always has one)
    quality = replace(
        model.quality,
        is_accepted=not reasons,
        reasons=tuple(reasons),
        error_mm=error_mm,
        error_arcmin=error_arcmin,
        figures={
            "rms_px": calibration.rms_px,
            "held_out_mm": held_mm,
            "held_out_arcmin": held_arcmin,
            "views_used": float(len(views)),
            "views_dropped": float(len(dropped)),
            "anatomy_near_mm": float(distances.min()),
            "anatomy_far_mm": float(distances.max()),
        },
    )
    return replace(calibration, model=replace(model, quality=quality))

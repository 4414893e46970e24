"""Measures a latency and raises `ResultError`, in one sentence, where it cannot be trusted."""

import numpy as np

from calibration.latency.display_area import WatchedCells, compute_seen_deviations
from calibration.latency.light_code import LONGEST_PAUSE_MS, SHORTEST_PAUSE_MS, Switches
from calibration.latency.measurement import Estimate, EyeLag, Latency, measure_latency
from navapp.errors import ResultError

# What is promised of the result.
WORST_MS = 3.0
# So many frames bring the bound below it (tests/bench/latency_accuracy.py).
FEWEST_FRAMES = 200
# Chance exceeds it once in three million looks.
_SURELY = 5.0
_MOST_OTHER_PEAKS = 0.05
# The code explains at least as much of the area's changes as all else together.
_LEAST_EXPLAINED = 0.5
# A share of wrong frames is a share of the mean pause by which switches came at another time.
_MOST_WRONG = WORST_MS / (0.5 * (SHORTEST_PAUSE_MS + LONGEST_PAUSE_MS))
_SIGMAS = 2.5
# Switches wait for the next refresh, and spread over one: the window cannot be much narrower.
_LEAST_WIDTH = 0.6


def measure_accepted_latency(
    switches: Switches, left: WatchedCells, right: WatchedCells, refresh_hz: float
) -> Latency:
    """Measure, and refuse what cannot be believed.

    Args:
        switches: when the display was told to change.
        left: n frames of that eye.
        right: the frames of the same pairs.
        refresh_hz: of the display.

    Raises:
        ResultError: one sentence that says why there is no result.
    """
    _check_frames(switches, left)
    _check_seen(switches, left, right)
    found = measure_latency(switches, left, right)
    for name, eye in (("left", found.left), ("right", found.right)):
        _check_fit(name, eye)
    for name, eye in (("left", found.left), ("right", found.right)):
        _check_phase(name, eye, refresh_hz)
        _check_steady(name, eye)
    _check_bound("display delay", found.delay)
    _check_bound("offset of the right camera", found.late)
    return found


def _check_frames(switches: Switches, left: WatchedCells) -> None:
    n, lasts_s = len(left.times_ms), 1e-3 * float(switches.times_ms[-1] - switches.times_ms[0])
    if n < FEWEST_FRAMES:
        raise ResultError(
            f"the camera gave {n} frames in {lasts_s:.0f} s, {FEWEST_FRAMES} are needed",
            remedy="measure longer (--seconds), or with a higher [camera] rate_hz",
        )


def _check_seen(switches: Switches, left: WatchedCells, right: WatchedCells) -> None:
    is_seen = [_is_seen(switches, watched) for watched in (left, right)]
    if not any(is_seen):
        raise ResultError(
            "neither camera sees the display flash: no part of the pictures changes with it",
            remedy="point the cameras at the display, and make the room darker",
        )
    if not all(is_seen):
        name, other = ("left", "right") if is_seen[1] else ("right", "left")
        raise ResultError(
            f"the {name} camera does not see the display flash, the {other} one does",
            remedy=f"uncover the {name} camera, and show the display to both",
        )


def _is_seen(switches: Switches, watched: WatchedCells) -> bool:
    """In all frames or in half of them: a delay that jumps may hide the code from all."""
    n = len(watched.times_ms)
    is_first = np.arange(n) < n // 2
    parts = (np.ones(n, dtype=bool), is_first, ~is_first)
    return any(compute_seen_deviations(switches, watched.only(part)) >= _SURELY for part in parts)


def _check_fit(name: str, eye: EyeLag) -> None:
    if eye.other_peak_fraction > _MOST_OTHER_PEAKS:
        raise ResultError(
            f"several delays fit what the {name} camera saw: "
            f"in {100 * eye.other_peak_fraction:.0f} % of resampled recordings "
            "another one fits better",
            remedy="measure longer (--seconds); stop what else uses the display or the computer",
        )
    if eye.explained < _LEAST_EXPLAINED:
        raise ResultError(
            f"a single delay explains only {100 * eye.explained:.0f} % of what changes in the "
            f"{name} camera's view of the display",
            remedy="make the display larger and brighter in the picture, the exposure shorter, "
            "and let nothing move in front of it",
        )


def _check_phase(name: str, eye: EyeLag, refresh_hz: float) -> None:
    refresh_ms = 1e3 / refresh_hz
    if eye.width_ms < _LEAST_WIDTH * refresh_ms:
        raise ResultError(
            f"the {name} camera is in step with the display: switches spread over "
            f"{eye.width_ms:.0f} ms only, with a refresh every {refresh_ms:.1f} ms, so that half "
            f"of it ({0.5 * refresh_ms:.1f} ms) cannot be told from none",
            remedy="choose a [camera] rate_hz that does not divide the display's rate (14 beside "
            "60), or give that rate with --refresh-hz",
        )


def _check_steady(name: str, eye: EyeLag) -> None:
    drift = eye.drift
    if abs(drift.value_ms) > max(WORST_MS, _SIGMAS * drift.sigma_ms):
        raise ResultError(
            f"the delay drifts: the {name} camera saw the second half of the switches "
            f"{drift.value_ms:+.1f} ms later than the first",
            remedy="wait until display and camera have settled, and measure again",
        )
    if eye.wrong_fraction > _MOST_WRONG:
        raise ResultError(
            f"the delay is not steady: {100 * eye.wrong_fraction:.0f} % "
            f"of the {name} camera's frames saw light for darkness or the reverse, "
            f"{100 * _MOST_WRONG:.0f} % are allowed",
            remedy="stop what else uses the display or the computer; a faint display does this, "
            "too: make it brighter",
        )


def _check_bound(what: str, found: Estimate) -> None:
    if found.bound_ms > WORST_MS:
        raise ResultError(
            f"the {what} is known to {found.bound_ms:.1f} ms only, {WORST_MS:.0f} ms are allowed",
            remedy="measure longer (--seconds), or make the display brighter in the picture",
        )

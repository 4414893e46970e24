"""How well a display in a mirror is calibrated, and how far guides appear from where they should.

usage: python -m tests.bench.mirror_accuracy [--setups N] [--computed N]
       python -m tests.bench.mirror_accuracy --keys [--operators N]

Set-ups are drawn at random: a 24 inch monitor of 1920 x 1080 seen at the bone's depth from 350 to
550 mm, a plate of 1 to 4 mm at some 45 degrees. For `--setups` of them pictures are rendered by
rays of their own, marks are found and the display is solved as `navapp calibrate mirror` does. In
each lies another knee, which is registered and followed; the product draws crosses on points of the
femur and the line of the distal cut, and both are read from the picture that the eye sees, against
where the true femur's points and line appear: drawn with the true pose and display, and with the
tracked pose and the solved display. For `--computed` more the marks are computed with noise.

With `--keys`, operators align crosses with an eye that wanders by 3 mm (95 %): N of them in all, a
third with each noise. Some more, one for each fifteen, align twelve with a shaking hand (3 px), in
a room without pictures, and then confirm what is lit: at once, or after a token move of one pixel.

The exit code is 1 when a limit is missed; each is told beside its figure.
"""

import argparse
import dataclasses

import numpy as np

from calibration.mirror.display_solution import solve_display
from calibration.mirror.first_state import Told
from navapp.devices.simulated_mirror import true_display
from sim_devices.mirror_setups import PITCH_MM, draw_setup
from tests.bench.mirror_limits import Limits
from tests.bench.mirror_pictures import N_VIEWS, by_pictures
from tests.calibration.mirror.simulated_operators import SimulatedOperator
from tests.calibration.mirror.simulated_views import drawn_views, scene
from tests.control.mirror_alignment.careless import TOKEN_MOVES, confirm_blindly
from tests.geometry.test_display_model_errors import seen_beside_mm

_FIRST_COMPUTED, _FIRST_OPERATOR = 31000, 310000
_NOISES_PX = (0.5, 1.0, 2.0)


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--setups", type=int, default=20)
    parser.add_argument("--computed", type=int, default=300)
    parser.add_argument("--keys", action="store_true")
    parser.add_argument("--operators", type=int, default=300)
    options = parser.parse_args()
    limits = Limits()
    if options.keys:
        by_keys(options.operators, limits)
        by_confirming(max(1, options.operators // 15), limits)
    else:
        if options.setups:
            by_pictures(options.setups, limits)
        if options.computed:
            by_marks(options.computed, limits)
    return 1 if limits.n_missed else 0


def by_marks(n_setups: int, limits: Limits) -> None:
    """The same solver on marks without pictures: do its predictions hold?"""
    below, errors, bounds, refused = [], [], [], 0
    for number in range(n_setups):
        rng = np.random.default_rng(_FIRST_COMPUTED + number)
        setup = draw_setup(rng)
        views, eye = drawn_views(rng, setup, N_VIEWS, every=6)
        told = Told(PITCH_MM * (1.0 + rng.normal(0.0, 0.002)),
                    setup.plate.thickness_mm + rng.normal(0.0, 0.4))  # fmt: skip
        found = solve_display(scene(), views, told)
        quality = found.model.quality
        refused += quality is None or not quality.is_accepted
        true = dataclasses.replace(true_display(setup), eye_mm=eye)
        error = seen_beside_mm(found.model, true, found.anatomy_mm, found.anatomy_mm)
        errors.append(error)
        bounds.append(found.predicted_mm)
        below.append(error <= found.predicted_mm)
    print(f"| {n_setups} set-ups without pictures | found | limit | |")
    print("|---|---|---|---|")
    error, bound = np.concatenate(errors), np.concatenate(bounds)
    print(f"| error of the model, median mm | {np.median(error):.4f} | | |")
    print(f"| error of the model, 95 % mm | {np.quantile(error, 0.95):.4f} | | |")
    limits.line("not accepted", refused, 0)
    limits.line("prediction holds", np.mean(np.concatenate(below)), 0.9, is_upper=False)
    limits.line("prediction over error, medians", np.median(bound) / np.median(error), 4.0)
    print()


def by_keys(n_operators: int, limits: Limits) -> None:
    """Operators with an eye that wanders, a third of them with each noise."""
    print("| noise px | operators | alignments median | most | predicted median mm "
          "| error median mm | rms at the anatomy, 95 % mm |")  # fmt: skip
    print("|---|" + "---|" * 6)
    told = []
    for sd_px in _NOISES_PX:
        n, below, accepted, errors, bounds, worst = [], [], [], [], [], []
        for number in range(n_operators // len(_NOISES_PX)):
            rng = np.random.default_rng(_FIRST_OPERATOR + number)
            operator = SimulatedOperator(draw_setup(rng), rng, sd_px)
            found, taken = operator.calibrate()
            quality = found.model.quality
            is_good = quality is not None and quality.is_accepted
            error = seen_beside_mm(found.model, operator.true, found.anatomy_mm, found.anatomy_mm)
            n.append(taken)
            accepted.append(is_good and taken <= 40)
            below.append(error <= found.predicted_mm)
            errors.append(np.median(error))
            bounds.append(np.median(found.predicted_mm))
            worst.append(np.sqrt(np.mean(error**2)))
        rms_mm = np.quantile(worst, 0.95)
        print(f"| {sd_px} | {len(n)} | {np.median(n):.0f} | {max(n)} | {np.median(bounds):.3f} "
              f"| {np.median(errors):.3f} | {rms_mm:.3f} |", flush=True)  # fmt: skip
        told.append((sd_px, np.mean(accepted), np.mean(below)))
    print("\n| by keys | found | limit | |")
    print("|---|---|---|---|")
    for sd_px, share, _ in told:
        if sd_px <= 1.0:
            limits.line(f"accepted within 40, {sd_px} px", share, 0.9, is_upper=False)
        else:
            print(f"| accepted within 40, {sd_px} px | {share:.3f} | | |")
    holds = float(np.mean([below for _, _, below in told]))
    limits.line("prediction holds", holds, 0.9, is_upper=False)
    print()


def by_confirming(n_operators: int, limits: Limits) -> None:
    """Operators who confirm crosses that they did not align: nothing may come of it."""
    print("| confirmed without aligning | operators | alignments, most | predicted least mm |")
    print("|---|" + "---|" * 3)
    n_false = n_accepted = 0
    for name, move in TOKEN_MOVES.items():
        ended = [confirm_blindly(seed, 12, move) for seed in range(1, n_operators + 1)]
        least_mm = min(one.error_mm for one in ended)
        print(f"| {name} | {n_operators} | {max(one.n_kept for one in ended)} | {least_mm:.2f} |")
        n_false += sum(one.is_false for one in ended)
        n_accepted += sum(one.is_accepted for one in ended)
    print("\n| confirmed without aligning | found | limit | |")
    print("|---|---|---|---|")
    limits.line("accepted", n_accepted, 0)
    limits.line("accepted, with a larger error than predicted", n_false, 0)


if __name__ == "__main__":
    raise SystemExit(main())

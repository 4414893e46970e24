"""How far landmarks estimated from surfaces are from the simulator's, and which sides are told.

    python -m tests.bench.landmarks

Twenty simulated knees (ten people, both sides). The simulator's own landmarks are the truth, where
they have the same meaning. Sides are told from a bone alone, and from all three.
"""

import numpy as np

from navapp.preop.landmarks import estimate_landmarks
from navapp.preop.side_estimate import estimate_side
from tests.preop.knees import bones_of, knees

_SETS = (("femur",), ("tibia",), ("patella",), ("femur", "tibia", "patella"))


def main() -> None:
    """Print both tables."""
    found: dict[str, list[tuple[float, float]]] = {}
    for knee in knees():
        for name, landmark in estimate_landmarks(bones_of(knee)).items():
            if name in knee.landmarks:
                error_mm = float(np.linalg.norm(landmark.point_mm - knee.landmarks[name]))
                found.setdefault(name, []).append((error_mm, landmark.sd_mm or 0.0))
    print("| landmark | found | error, median | largest | deviation told, median |")
    print("|---|---|---|---|---|")
    for name, pairs in found.items():
        errors, sds = np.array(pairs).T
        figures = f"{np.median(errors):.1f} mm | {errors.max():.1f} mm | {np.median(sds):.1f} mm"
        print(f"| {name} | {len(pairs)} of {len(knees())} | {figures} |")
    print("\n| bones | right | unknown | wrong |\n|---|---|---|---|")
    for names in _SETS:
        told = [
            (knee.spec.side, estimate_side({name: bones_of(knee)[name] for name in names}).side)
            for knee in knees()
        ]
        right, unknown = sum(a == b for a, b in told), sum(b is None for _, b in told)
        wrong = len(told) - right - unknown
        print(f"| {', '.join(names)} | {right} | {unknown} | {wrong} |")


if __name__ == "__main__":
    main()

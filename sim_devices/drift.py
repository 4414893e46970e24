"""A leg that is moved to and fro across the view at a constant speed."""

import math

# Length of the way on each side of the rest position that is passed at full speed. Beyond 30 mm the
# bone would slide under the drape, which stays.
STRAIGHT_MM = 15.0
# With a higher speed it would have to turn round before it has reached it.
HIGHEST_MM_S = 300.0
# How long it takes to turn round: the speed falls, and rises the other way, in proportion to time.
TURN_S = 0.2
# The leg lies still at first, so that the bone can be registered, and then gathers speed.
REST_S = 0.2
START_S = 0.5 * TURN_S


def compute_drift_mm(speed_mm_s: float, time_s: float) -> float:
    """How far the leg is from its rest position, along x of the table."""
    if speed_mm_s <= 0.0 or time_s <= REST_S:
        return 0.0
    moving_s = time_s - REST_S
    if moving_s < START_S:
        return 0.5 * speed_mm_s * moving_s * moving_s / START_S
    # As if it had come past the rest position at full speed.
    since_s = moving_s - 0.5 * START_S
    straight_s = 2.0 * STRAIGHT_MM / speed_mm_s
    half, within_s = divmod(since_s + 0.5 * straight_s, straight_s + TURN_S)
    if within_s < straight_s:
        place_mm = speed_mm_s * within_s - STRAIGHT_MM
    else:
        turning_s = within_s - straight_s
        place_mm = STRAIGHT_MM + speed_mm_s * turning_s * (1.0 - turning_s / TURN_S)
    return -place_mm if math.fmod(half, 2.0) else place_mm

"""Options of `navapp calibrate mirror` that tell the display and its plate."""

import argparse
import math

from navapp.errors import UsageError

USUAL_GLASS_MM = 3.0
_MM_PER_INCH = 25.4


def find_pitch_mm(options: argparse.Namespace, size: tuple[int, int]) -> float | None:
    """Of a display of that size in px, from its diagonal; None when that is not told.

    Raises:
        UsageError: no possible length.
    """
    if options.diagonal_inch is None:
        return None
    if not 0.0 < options.diagonal_inch < 1000.0:
        raise UsageError("--diagonal-inch must be a length", remedy="give it in inches, such as 24")
    return float(options.diagonal_inch * _MM_PER_INCH / math.hypot(*size))

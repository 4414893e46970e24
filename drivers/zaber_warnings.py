"""Zaber's warning flags: their names, and what they say of the place where an axis stands.

Source: Zaber's ASCII Protocol Manual, warning flags.
"""

NAMES = {
    "FF": "critical fault",
    "FN": "axis not supported",
    "FZ": "axis inactive",
    "FH": "emergency stop",
    "FV": "voltage out of range",
    "FO": "motor driver off",
    "FC": "inrush current",
    "FM": "motor too hot",
    "FD": "motor driver disabled",
    "FQ": "encoder error",
    "FI": "index error",
    "FA": "analog encoder error",
    "FR": "overdrive limit exceeded",
    "FS": "stalled and stopped",
    "FB": "bounds of a stream exceeded",
    "FP": "left its path",
    "FE": "limit error",
    "FT": "twisted",
    "WL": "unexpected limit",
    "WV": "supply voltage low or high",
    "WT": "controller hot",
    "WS": "stalled and recovered",
    "WM": "displaced while it stood",
    "WP": "calibration of another type",
    "WR": "no reference position",
    "WH": "not homed",
    "NC": "turned by hand",
    "NI": "movement interrupted",
    "ND": "path not continuous",
    "NR": "value rounded",
    "NT": "value truncated",
    "NU": "setting pending",
    "NJ": "joystick calibrating",
    "NB": "firmware being updated",
}
_HARMLESS = ("WV", "WT", "WP", "ND", "NR", "NT", "NU")
# After these the place is not known, however the flags look later; and after every fault.
_COSTS_REFERENCE = ("WL", "WS", "WM", "WR", "WH")


def costs_reference(flag: str) -> bool:
    """Whether the mount must be homed again."""
    return flag.startswith("F") or flag in _COSTS_REFERENCE


def is_harmless(flag: str) -> bool:
    """Whether the mount still stands where it was sent; one that we do not know is not."""
    return flag in _HARMLESS


def describe(flags: tuple[str, ...]) -> str:
    """For people."""
    return ", ".join(f"{NAMES.get(flag, 'unknown warning')} ({flag})" for flag in flags)

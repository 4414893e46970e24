"""Meaning of ESC/VP21's codes for power states and faults.

Source: ESC/VP21 Command User's Guide for Business Projectors. Models differ in what they call
standby; only `01` can show a picture.
"""

from drivers.interfaces import PowerState

_POWER = {
    "00": PowerState.STANDBY,
    "01": PowerState.ON,
    "02": PowerState.WARMING,
    "03": PowerState.COOLING,
    "04": PowerState.STANDBY,
    "05": PowerState.FAULT,
    "09": PowerState.STANDBY,
}
# The guide's numbers are hexadecimal.
_FAULTS = {
    0x01: "fan",
    0x03: "lamp at power on",
    0x04: "internal temperature",
    0x06: "lamp",
    0x07: "lamp cover",
    0x08: "cinema filter",
    0x09: "capacitor",
    0x0A: "auto iris",
    0x0B: "subsystem",
    0x0C: "low air flow",
    0x0D: "air-flow sensor",
    0x0E: "power supply",
    0x0F: "shutter",
    0x10: "cooling element",
    0x11: "cooling pump",
    0x12: "static iris",
    0x13: "power supply",
    0x14: "exhaust shutter",
    0x15: "obstacle",
    0x16: "interface board",
    0x17: "stack link",
    0x18: "internal bus",
}


def parse_power_state(code: str | None) -> PowerState:
    """Of `PWR?`; a code that we do not know, or none at all, is a fault."""
    return _POWER.get(code or "", PowerState.FAULT)


def parse_faults(code: str | None) -> tuple[str, ...]:
    """Of `ERR?`, two hexadecimal digits; at most one is told at a time."""
    number = int(code or "00", 16)
    return () if number == 0 else (_FAULTS.get(number, f"fault {number:02X}"),)

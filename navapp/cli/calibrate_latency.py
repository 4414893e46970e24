"""`navapp calibrate latency`: how late the display is seen, and which eye exposes later."""

import argparse
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import UsageError

if TYPE_CHECKING:
    from calibration.latency.measurement import Estimate, EyeLag, Latency
    from navapp.control.display_delay.code_recording import CodeRecording
    from navapp.devices import OpenedLatency

_EXAMPLE = """\
examples:
  navapp calibrate latency                                  the simulated display and cameras
  navapp --config mine.toml calibrate latency --json latency.json

The display of the configuration flashes irregularly, some fourteen times a second: warn people
whom that makes ill. The cameras must see it, standing still, and nothing may move in front of it.
"""
_SHORTEST_S, _LONGEST_S = 5.0, 600.0


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "latency",
        help="the delay from camera to display, and between the two cameras",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--seconds", type=float, default=30.0, metavar="S", help="how long it flashes (30)"
    )
    parser.add_argument(
        "--refresh-hz", type=float, default=60.0, metavar="F", help="of the display (60)"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Show, watch, solve; the exit code."""
    from calibration.latency.acceptance import measure_accepted_latency
    from navapp.config import find_file, load
    from navapp.devices import open_latency

    check_writable(options.json)
    if not _SHORTEST_S <= options.seconds <= _LONGEST_S:
        raise UsageError(f"--seconds must be {_SHORTEST_S:.0f} to {_LONGEST_S:.0f}")
    if not 1.0 <= options.refresh_hz <= 1000.0:
        raise UsageError("--refresh-hz must be 1 to 1000")
    configuration = load(find_file(options.config))
    with ExitStack() as undo:
        opened = open_latency(configuration)
        undo.callback(opened.close)
        names = (opened.display.info.name, opened.camera.info.name)
        recording = _watch(opened, options, diagnostics)
    found = measure_accepted_latency(
        recording.switches, recording.left, recording.right, options.refresh_hz
    )
    write_json(options.json, "calibrate latency", _content(found, recording, names))
    if options.json != "-":
        _tell(found, names, diagnostics)
    return 0


def _watch(
    opened: "OpenedLatency", options: argparse.Namespace, diagnostics: Diagnostics
) -> "CodeRecording":
    from calibration.latency.light_code import draw_pauses_ms
    from navapp.control.display_delay.code_player import CodePlayer
    from navapp.control.display_delay.code_recording import record_code

    # Any seed will do; always the same one makes a simulated measurement repeatable.
    pauses = draw_pauses_ms(options.seconds, seed=0)
    player = CodePlayer(opened.display, opened.clock, pauses)
    return record_code(
        opened.camera, player, opened.clock, lambda share: diagnostics.progress("flashing", share)
    )


def _content(
    found: "Latency", recording: "CodeRecording", names: tuple[str, str]
) -> dict[str, Any]:
    return {
        "display": names[0],
        "camera": names[1],
        "display_delay_ms": _estimate(found.delay),
        "capture_offset_ms": {
            **_estimate(found.offset),
            "stamped": found.stamped_ms,
            "unstamped": found.late.value_ms,
        },
        "frame_age_ms": recording.age_ms,
        "frames": found.n_frames,
        "switches": found.n_switches,
        "left": _eye(found.left),
        "right": _eye(found.right),
    }


def _estimate(one: "Estimate") -> dict[str, float]:
    return {"value": one.value_ms, "sigma": one.sigma_ms, "bound": one.bound_ms}


def _eye(eye: "EyeLag") -> dict[str, Any]:
    return {
        "delay_ms": _estimate(eye.lag),
        "drift_ms": eye.drift.value_ms,
        "width_ms": eye.width_ms,
        "swing": eye.swing,
        "area_share": eye.area_fraction,
        "explained": eye.explained,
        "wrong_share": eye.wrong_fraction,
    }


def _tell(found: "Latency", names: tuple[str, str], diagnostics: Diagnostics) -> None:
    delay, offset = found.delay, found.offset
    diagnostics.say(
        f"{names[0]} is seen {delay.value_ms:.1f} ms after the call that shows a picture, "
        f"95 % bound {delay.bound_ms:.1f} ms (on the time stamps of {names[1]})"
    )
    diagnostics.say(
        f"the right camera exposes {offset.value_ms:+.1f} ms after the left one, 95 % bound "
        f"{offset.bound_ms:.1f} ms; its time stamps say {found.stamped_ms:+.1f} ms"
    )
    diagnostics.say(
        f"{found.n_switches} switches in {found.n_frames} frames; the display fills "
        f"{100 * found.left.area_fraction:.0f} % of the left picture and "
        f"{100 * found.right.area_fraction:.0f} % of the right one, "
        f"{found.left.swing:.0f} and {found.right.swing:.0f} grey values from dark to light"
    )
    if abs(found.late.value_ms) > found.late.bound_ms:
        order = "early" if found.late.value_ms > 0.0 else "late"
        diagnostics.warn(
            f"the right camera's time stamps are {abs(found.late.value_ms):.1f} ms too {order}: "
            "the two pictures of a moving bone are not of one moment; trigger the cameras together"
        )
    if delay.value_ms > 0.0:
        diagnostics.say(
            f"for the configuration:\n\n[display]\ndelay_ms = {delay.value_ms:.1f}\n"
            f"delay_bound_ms = {delay.bound_ms:.1f}"
        )

"""Start one firmware, for a person with a terminal program: behind a pseudo-terminal or a socket.

python -m sim_devices.firmware escvp21
python -m sim_devices.firmware zaber --speed 10 --path /tmp/stage
python -m sim_devices.firmware pjlink --port 4352 --password secret
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from drivers.clock import Clock
from sim_devices.firmware import pjlink_server
from sim_devices.firmware.escvp21 import ProjectorFirmware
from sim_devices.firmware.fast_clock import FastClock
from sim_devices.firmware.pseudo_terminal import PseudoTerminal
from sim_devices.firmware.wire import Firmware, Wire
from sim_devices.firmware.zaber import StageFirmware

_ON_A_SOCKET = "pjlink"  # with arguments of its own
Deeds = Mapping[str, Callable[[], object]]


def main(arguments: list[str] | None = None) -> int:
    """Run until the input ends; lines of it are things that happen to the device."""
    given = sys.argv[1:] if arguments is None else arguments
    if given[:1] == [_ON_A_SOCKET]:
        pjlink_server.main(given[1:])
        return 0
    options = _parser().parse_args(given)
    clock = FastClock(options.speed)
    firmware, deeds = _MAKERS[options.kind](clock)
    with tempfile.TemporaryDirectory() as folder:
        path = options.path or Path(folder) / options.kind
        terminal = PseudoTerminal(Wire(firmware, clock), path)
        every = {**deeds, "unplug": terminal.unplug, "plug": terminal.plug}
        terminal.plug()
        _say(f"{options.kind} answers at {path}", f"type: {', '.join(every)}; end with Ctrl-D")
        try:
            for line in sys.stdin:
                _happen(every, line.strip(), terminal)
        except KeyboardInterrupt:
            pass
        finally:
            terminal.unplug()
    return 0


def _happen(deeds: Deeds, name: str, terminal: PseudoTerminal) -> None:
    if name in ("unplug", "plug"):
        # The thread that holds the firmware is joined.
        terminal.unplug()
        if name == "plug":
            terminal.plug()
    elif name in deeds:
        with terminal.held:
            deeds[name]()
    elif name:
        _say(f"'{name}' is none of: {', '.join(deeds)}")


def _projector(clock: Clock) -> tuple[Firmware, Deeds]:
    firmware = ProjectorFirmware(clock)
    return firmware, {
        "event": firmware.event,
        "break": lambda: firmware.break_down(fault=0x04),
        "mains off": firmware.lose_mains,
        "mains on": firmware.restore_mains,
    }


def _stage(clock: Clock) -> tuple[Firmware, Deeds]:
    firmware = StageFirmware(clock)
    return firmware, {
        "knob": lambda: firmware.turn_by_hand(2.0),
        "push": lambda: firmware.push(2.0),
        "stall": lambda: setattr(firmware, "stalls_at", 0.5),
        "power off": firmware.lose_power,
        "power on": firmware.restore_power,
    }


_MAKERS: dict[str, Callable[[Clock], tuple[Firmware, Deeds]]] = {
    "escvp21": _projector,
    "zaber": _stage,
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m sim_devices.firmware", description=__doc__)
    parser.add_argument("kind", choices=[*_MAKERS, _ON_A_SOCKET])
    parser.add_argument("--speed", type=float, default=1.0, help="how much faster time passes")
    parser.add_argument("--path", type=Path, help="where the link to the terminal is made")
    return parser


def _say(*lines: str) -> None:
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())

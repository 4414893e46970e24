"""Random bytes on the line: no driver hangs, fails in its own way, or believes what is not so."""

import random
from collections.abc import Callable

import pytest

from drivers.interfaces import CommandResult, PowerState
from navapp.errors import DeviceError
from sim_devices.firmware import wire
from sim_devices.firmware.escvp21 import Power, ProjectorModel
from sim_devices.firmware.wire import Pieces
from tests.drivers.firmware_rigs import SERIAL, ProjectorRig, StageRig
from tests.many import few_of

REPLIES = few_of([20_000, 100_000])
# Beyond all that a driver may wait for: lamp, probes, retries.
LONGEST_S = 400.0
TOLERANCE_DEG = 0.01
SWITCHES = ("MUTE", "HREVERSE", "VREVERSE")
POWERS = {
    Power.STANDBY: PowerState.STANDBY,
    Power.WARMING: PowerState.WARMING,
    Power.ON: PowerState.ON,
    Power.COOLING: PowerState.COOLING,
    Power.ABNORMAL: PowerState.FAULT,
}


class Fuzz:
    """Spoils a share of the messages, each in a random way, and counts them."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.n_replies = 0
        self.share = 0.0
        self.heard: list[bytes] = []
        self.ways: list[wire.Spoiler] = [
            wire.lose,
            wire.double,
            wire.corrupt(self.random),
            wire.split(0.001),
            wire.late(0.7),
            wire.late(4.0),
            self.noise,
            self.noise_before,
            self.cut,
            self.torn,
        ]

    def __call__(self, message: bytes) -> Pieces:
        self.n_replies += 1
        if self.random.random() >= self.share:
            return wire.whole(message)
        return self.random.choice(self.ways)(message)

    def noise(self, message: bytes) -> Pieces:
        return [(0, self.random.randbytes(self.random.randint(1, 60)))]

    def noise_before(self, message: bytes) -> Pieces:
        return [(0, self.random.randbytes(self.random.randint(1, 30)) + message)]

    def cut(self, message: bytes) -> Pieces:
        return [(0, message[: self.random.randint(0, len(message))])]

    def torn(self, message: bytes) -> Pieces:
        """In two pieces, the second late; sometimes later than the driver waits."""
        place = self.random.randint(0, len(message))
        gap_ns = self.random.randint(0, 4_000_000_000)
        return [(0, message[:place]), (gap_ns, message[place:])]

    def misread(self, message: bytes) -> Pieces:
        """Other digits in the same places: it reads well and is wrong."""
        digits = bytes(self.random.choice(b"0123456789") if 48 <= b <= 57 else b for b in message)
        return wire.whole(digits)

    def replayed(self, message: bytes) -> Pieces:
        """An older message instead, as it was."""
        self.heard.append(message)
        return wire.whole(self.random.choice(self.heard[-200:]))

    def command(self, data: bytes) -> bytes:
        """Commands suffer too, more rarely."""
        if self.random.random() < 0.97 or not data:
            return data
        return bytes(self.noise(data)[0][1]) if self.random.random() < 0.5 else data[:-1]


def drive(
    rig: ProjectorRig | StageRig, fuzz: Fuzz, n_replies: int, actions: list[Callable[[], object]]
) -> tuple[int, int]:
    """Do random things until all replies have come; how many went well, and how many did not."""
    n_well = n_failed = 0
    rig.wire.spoiler, rig.wire.command_spoiler = fuzz, fuzz.command
    while fuzz.n_replies < n_replies:
        begin_s = rig.now_s
        fuzz.share = fuzz.random.choice((0.02, 0.2, 0.7))
        try:
            rig.driver.open()
            fuzz.random.choice(actions)()
            n_well += 1
        except DeviceError:
            n_failed += 1
        assert rig.now_s - begin_s < LONGEST_S
        # What a break or a fault of the lamp left behind.
        rig.clock.advance_ns(fuzz.random.randint(0, 10**9))
    return n_well, n_failed


@pytest.mark.slow
@pytest.mark.parametrize("n_replies", REPLIES)
def test_a_projector_never_believes_a_spoilt_line(n_replies: int) -> None:
    rig = ProjectorRig(ProjectorModel(is_quick=True, has_events=True, cooling_s=5.0))
    fuzz, model = Fuzz(1), rig.firmware.model
    n_verified = dict.fromkeys(("power", "source", "mute", "flips", "status"), 0)

    def verified(what: str, result: CommandResult, truth: Callable[[], object], wanted: object):
        if result is CommandResult.VERIFIED:
            assert truth() == wanted, what
            n_verified[what] += 1

    def power() -> None:
        is_on = fuzz.random.random() < 0.8
        wanted = Power.ON if is_on else Power.STANDBY
        result = rig.driver.set_power(is_on, 150.0)
        verified("power", result, lambda: rig.firmware.power, wanted)

    def source() -> None:
        wanted = fuzz.random.choice(("30", "A0", "10"))
        result = rig.driver.set_source(wanted, 5.0)
        verified("source", result, lambda: model.settings["SOURCE"], wanted)

    def mute() -> None:
        wanted = fuzz.random.random() < 0.5
        result = rig.driver.set_mute(wanted, 3.0)
        verified("mute", result, lambda: model.settings["MUTE"] == "ON", wanted)

    def flips() -> None:
        wanted = [fuzz.random.random() < 0.5 for _ in range(2)]
        result = rig.driver.set_flips(*wanted, 3.0)
        names = ("HREVERSE", "VREVERSE")
        verified("flips", result, lambda: [model.settings[n] == "ON" for n in names], wanted)

    def status() -> None:
        assert rig.driver.status().serial in ("", SERIAL)

    def status_after_noise() -> None:
        """When the last spoilt answer has come, nothing of what was is taken for what is."""
        rig.clock.advance_ns(10 * 10**9)
        fuzz.share = 0.0
        before = rig.firmware.power
        told = rig.driver.status()
        if before is rig.firmware.power:
            # FAULT is also what it says when commands do not reach it.
            assert told.power in (POWERS[before], PowerState.FAULT)
        if told.power is PowerState.ON:
            truth = (model.settings["SOURCE"], *(model.settings[n] == "ON" for n in SWITCHES))
            switches = (told.is_muted, told.flips_horizontally, told.flips_vertically)
            for said, so in zip((told.source, *switches), truth, strict=True):
                assert said in (None, so)
            n_verified["status"] += said is not None

    actions = [power, source, mute, flips, status, status_after_noise]
    n_well, n_failed = drive(rig, fuzz, n_replies, actions)
    assert n_well > n_replies // 100
    assert n_failed > n_replies // 100
    # The test sees something: each kind of command was verified often.
    assert min(n_verified.values()) > n_replies // 1000, n_verified


@pytest.mark.slow
@pytest.mark.parametrize("n_replies", REPLIES)
def test_a_mirror_never_believes_a_spoilt_line(n_replies: int) -> None:
    rig = StageRig()
    fuzz, firmware = Fuzz(2), rig.firmware
    # A protocol with numbers and checksums must bear these as well.
    fuzz.ways += [fuzz.misread, fuzz.replayed] * 2
    n_known = dict.fromkeys(("position", "arrived"), 0)

    def home() -> None:
        rig.driver.home(20.0)
        assert abs(firmware.true_deg) < TOLERANCE_DEG

    def move() -> None:
        angle_deg = fuzz.random.uniform(0.0, 120.0)
        rig.driver.move_to(angle_deg, 20.0)
        assert abs(firmware.true_deg - angle_deg) < TOLERANCE_DEG
        n_known["arrived"] += 1

    def position() -> None:
        angle_deg = rig.driver.position_deg()
        if angle_deg is not None:
            assert abs(firmware.true_deg - angle_deg) < TOLERANCE_DEG
            n_known["position"] += 1

    def trouble() -> None:
        deed = fuzz.random.choice(
            (
                lambda: firmware.turn_by_hand(1.0),
                lambda: firmware.push(1.0),
                lambda: setattr(firmware, "stalls_at", 0.3),
                firmware.restore_power,
                rig.driver.stop,
            )
        )
        deed()

    actions = [home, move, move, position, position, position, trouble]
    n_well, n_failed = drive(rig, fuzz, n_replies, actions)
    assert n_well > n_replies // 100
    assert n_failed > n_replies // 100
    assert min(n_known.values()) > n_replies // 1000, n_known

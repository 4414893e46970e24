"""Simulated firmware of a PJLink class 1 projector: bytes in, bytes out.

Written from the protocol's tables and not from the driver, so that an error in one is seen by the
other. What a manual says in words is here in numbers: times by the injected clock.
"""

import hashlib
import random
import re
from enum import Enum

from drivers.clock import Clock

_NS = 1_000_000_000
IDLE_CLOSE_NS = 30 * _NS
_MOST_LINE_BYTES = 256
_REQUEST = re.compile(r"%1(\w{4}) (.{1,128})")


class Lamp(Enum):
    """Values as POWR tells them."""

    STANDBY = "0"
    ON = "1"
    COOLING = "2"
    WARMING = "3"


class PjlinkProjector:
    """The projector behind all connections.

    Attributes:
        inputs: sources that it has.
        faults: digits of ERST: fan, lamp, temperature, cover, filter, other.
        is_failed: POWR, INPT and AVMT answer ERR4.
        lacks: commands that it does not know.
        is_powered: it has mains.
        name: that it carries.
    """

    def __init__(
        self,
        clock: Clock,
        *,
        password: str = "",
        warming_s: float = 40.0,
        cooling_s: float = 60.0,
        seed: int = 1,
    ) -> None:
        self._clock = clock
        self.password = password
        self._warming_ns, self._cooling_ns = round(warming_s * _NS), round(cooling_s * _NS)
        self._random = random.Random(seed)
        self.inputs = ("11", "31", "32")
        self.faults = "000000"
        self.is_failed = False
        self.lacks: tuple[str, ...] = ()
        self.is_powered = True
        self.name = "sim:projector"
        self._lamp, self._until_ns = Lamp.STANDBY, 0
        self._lit_ns, self._lamp_ns = 0, 1633 * 3600 * _NS
        self._input, self._mute = "31", "30"
        self._switches = {"POWR": self._power, "INPT": self._choose, "AVMT": self._silence}

    @property
    def clock(self) -> Clock:
        """By which its lamp warms and cools."""
        return self._clock

    @property
    def lamp(self) -> Lamp:
        """What the lamp does now."""
        if self._clock.now_ns() >= self._until_ns:
            if self._lamp is Lamp.WARMING:
                self._lamp, self._lit_ns = Lamp.ON, self._until_ns
            elif self._lamp is Lamp.COOLING:
                self._lamp = Lamp.STANDBY
        return self._lamp

    @property
    def picture_source(self) -> str:
        """Source whose picture it shows."""
        return self._input

    @property
    def is_picture_hidden(self) -> bool:
        """Whether the picture is muted."""
        return self._mute in ("11", "31")

    def cut_power(self) -> None:
        """Pull the mains plug: the lamp is off, nothing is answered."""
        self._end_light()
        self.is_powered, self._lamp, self._mute = False, Lamp.STANDBY, "30"

    def restore_power(self) -> None:
        """Put it back: standby."""
        self.is_powered = True

    def connection(self) -> "PjlinkSession":
        """What a new client talks to."""
        salt = "".join(self._random.choice("0123456789abcdef") for _ in range(8))
        return PjlinkSession(self, salt if self.password else "")

    def answer(self, command: str, parameter: str) -> str:
        """Value of the reply to a request."""
        if command in self.lacks or command not in (*self._switches, *self._texts()):
            return "ERR1"
        if self.is_failed and command in ("POWR", "INPT", "AVMT"):
            return "ERR4"
        if command in self._switches:
            return self._switches[command](parameter)
        return self._texts()[command] if parameter == "?" else "ERR2"

    def _texts(self) -> dict[str, str]:
        return {
            "LAMP": self._hours(),
            "ERST": self.faults,
            "INST": " ".join(self.inputs),
            "NAME": self.name,
            "INF1": "SIMULATED",
            "INF2": "PJLink class 1",
            "INFO": "",
            "CLSS": "1",
        }

    def _end_light(self) -> None:
        if self.lamp is Lamp.ON:
            self._lamp_ns += self._clock.now_ns() - self._lit_ns

    def _power(self, parameter: str) -> str:
        lamp, now_ns = self.lamp, self._clock.now_ns()
        if parameter == "?":
            return lamp.value
        if parameter not in ("0", "1"):
            return "ERR2"
        if lamp in (Lamp.WARMING, Lamp.COOLING):
            return "ERR3"
        if parameter == "1" and lamp is Lamp.STANDBY:
            self._lamp, self._until_ns = Lamp.WARMING, now_ns + self._warming_ns
        if parameter == "0" and lamp is Lamp.ON:
            self._end_light()
            self._lamp, self._until_ns, self._mute = Lamp.COOLING, now_ns + self._cooling_ns, "30"
        return "OK"

    def _choose(self, parameter: str) -> str:
        if parameter != "?" and parameter not in self.inputs:
            return "ERR2"
        if self.lamp is not Lamp.ON:
            return "ERR3"
        if parameter == "?":
            return self._input
        self._input = parameter
        return "OK"

    def _silence(self, parameter: str) -> str:
        if parameter not in ("?", "10", "11", "20", "21", "30", "31"):
            return "ERR2"
        if self.lamp is not Lamp.ON:
            return "ERR3"
        if parameter == "?":
            return self._mute
        self._mute = parameter
        return "OK"

    def _hours(self) -> str:
        is_on = self.lamp is Lamp.ON
        lit_ns = self._clock.now_ns() - self._lit_ns if is_on else 0
        hours = (self._lamp_ns + lit_ns) // (3600 * _NS)
        return f"{hours} {int(is_on)}"


class PjlinkSession:
    """One client's connection.

    Attributes:
        is_over: the projector hangs up.
    """

    def __init__(self, projector: PjlinkProjector, salt: str) -> None:
        self._projector = projector
        self._salt = salt
        self._is_trusted = not salt
        self._received = b""
        self._last_ns = projector.clock.now_ns()
        self.is_over = False

    def greeting(self) -> bytes:
        """What it says first."""
        return f"PJLINK 1 {self._salt}\r".encode() if self._salt else b"PJLINK 0\r"

    def receive(self, data: bytes) -> bytes:
        """Answers to what came, in one piece."""
        replies = b""
        self._received += data
        while b"\r" in self._received and not self.is_over:
            line, _, self._received = self._received.partition(b"\r")
            # A terminal program ends its lines with a line feed, too.
            replies += self._reply(line.decode("latin-1").lstrip("\n"))
            self._last_ns = self._projector.clock.now_ns()
        if len(self._received) > _MOST_LINE_BYTES:
            self._received = b""
        return replies

    def tick(self) -> None:
        """Hang up when nothing was said for 30 s, or when the mains is gone."""
        is_idle = self._projector.clock.now_ns() - self._last_ns >= IDLE_CLOSE_NS
        self.is_over = self.is_over or is_idle or not self._projector.is_powered

    def _reply(self, line: str) -> bytes:
        if not self._is_trusted:
            expected = hashlib.md5((self._salt + self._projector.password).encode()).hexdigest()
            if not line.startswith(expected):
                self.is_over = True
                return b"PJLINK ERRA\r"
            self._is_trusted, line = True, line[len(expected) :]
        request = _REQUEST.fullmatch(line)
        if request is None:
            return b""
        command = request[1].upper()
        return f"%1{command}={self._projector.answer(command, request[2])}\r".encode()

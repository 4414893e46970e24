"""ESC/VP21 on a line: commands that end with CR, answers that end with a colon, events between.

On port 3629 of a network the line begins with a greeting (ESC/VP.net); then it is the same.

The colon ends every answer and every event, and nothing says which answer belongs to which command
but its name: so the line is brought into step again after every answer that did not come or could
not be understood, and what came unasked is thrown away before a command is sent.
"""

import re

from drivers.clock import Clock
from drivers.serial_line import SerialLine
from drivers.serial_port import Address
from navapp.errors import DeviceProtocolError, DeviceTimeout, UnsupportedControl

# Projectors on a network are greeted first: name, version, type of message, status.
_NETWORK_PORT = ":3629"
_GREETING = b"ESC/VP.net\x10\x03\x00\x00\x00\x00"
_STATUS_BYTE, _WELCOME = 14, 0x20

_ANSWER_S = 3.0
_PAUSE_NS = 100_000_000
_PROBES = 3
_MOST_UNASKED = 64
_NAMED = re.compile(r"([A-Z0-9]+)=([\x20-\x7e]*)")
_EVENT = "IMEVENT="
_REFUSED = "ERR"


class EscVp21Line:
    """Asks for values and gives commands, one at a time.

    Attributes:
        line: of bytes; its lock is held over a command and its answer.
        is_silent: the last probes were not answered. The projector is then in its abnormal state
            (lamp, temperature), busy with its lamp, without mains or without cable; never just off.
    """

    def __init__(self, address: Address, clock: Clock) -> None:
        self.line = SerialLine(address, clock, "projector", b":")
        self._clock = clock
        self._is_in_step = False
        self._free_at_ns = 0
        self.is_silent = False

    def open(self) -> None:
        """Connect and bring into step.

        Raises:
            DeviceNotFound, DeviceLost, DeviceProtocolError; DeviceTimeout: it is silent.
        """
        with self.line.lock:
            if self.line.is_open:
                return
            self.line.open()
            self._is_in_step = self.is_silent = False
            try:
                if self.line.address.name.endswith(_NETWORK_PORT):
                    self._greet()
                self._get_in_step()
            except BaseException:
                self.line.close()
                raise

    def ask(self, name: str, form: re.Pattern[str]) -> str | None:
        """Value of that name; None when the projector has none, or none in its present state.

        A question is harmless, so it is repeated once.

        Args:
            name: without the question mark.
            form: that the whole value must have.

        Raises:
            DeviceLost, DeviceTimeout, DeviceProtocolError.
        """
        with self.line.lock:
            try:
                return self._ask_once(name, form)
            except (DeviceTimeout, DeviceProtocolError):
                if self.is_silent:
                    raise
                return self._ask_once(name, form)

    def tell(self, command: str, timeout_s: float = _ANSWER_S) -> None:
        """Give a command and wait for the colon that says that it was executed.

        Raises:
            UnsupportedControl: refused. DeviceLost, DeviceTimeout, DeviceProtocolError: as it says.
        """
        with self.line.lock:
            self._send(command)
            deadline_ns = self.line.deadline_ns(timeout_s)
            # A named value is the late answer to a question.
            while (answer := self._answer(deadline_ns)) and answer != _REFUSED:
                continue
        if answer == _REFUSED:
            raise UnsupportedControl(
                f"the projector refuses '{command}'",
                subject="projector",
                remedy="it has no such setting, or not in its present state",
            )

    def close(self) -> None:
        """Disconnect; never fails."""
        self.line.close()

    def _ask_once(self, name: str, form: re.Pattern[str]) -> str | None:
        self._send(f"{name}?")
        deadline_ns = self.line.deadline_ns(_ANSWER_S)
        while (answer := self._answer(deadline_ns)) != _REFUSED:
            given, _, value = answer.partition("=")
            if given == name:
                if form.fullmatch(value) is None:
                    raise self._misunderstood(answer)
                return value
        return None

    def _send(self, command: str) -> None:
        if not self._is_in_step:
            self._get_in_step()
        self._clock.wait_until_ns(self._free_at_ns)
        self.line.discard()
        # Whatever happens before the answer leaves the line out of step.
        self._is_in_step = False
        self.line.send(f"{command}\r".encode("ascii"))

    def _answer(self, deadline_ns: int) -> str:
        """The next answer: empty for a bare colon, `ERR`, or `NAME=value`.

        Events are skipped, and so is what cannot be understood, unless nothing better comes.
        """
        if not self.line.remaining_s(deadline_ns):
            # The line may hold more than can be read: answers to other questions, without end.
            raise self.line.silence()
        damaged = ""
        for _ in range(_MOST_UNASKED):
            packet = self.line.next(deadline_ns)
            if packet is None:
                break
            self._free_at_ns = self._clock.now_ns() + _PAUSE_NS
            lines = [part for part in re.split("[\r\n]+", packet.decode("latin-1")) if part]
            answers = [part for part in lines if not part.startswith(_EVENT)]
            answer = "\r".join(answers)
            if lines and not answers:
                continue
            if answer in ("", _REFUSED) or _NAMED.fullmatch(answer):
                self._is_in_step = True
                return answer
            damaged = answer
        raise self._misunderstood(damaged) if damaged else self.line.silence()

    def _get_in_step(self) -> None:
        """Send bare CRs until one is answered; once is enough for one known to be silent."""
        for _ in range(1 if self.is_silent else _PROBES):
            self._clock.wait_until_ns(self._free_at_ns)
            self.line.discard()
            self.line.send(b"\r")
            if self._is_probe_answered(self.line.deadline_ns(_ANSWER_S)):
                self._is_in_step, self.is_silent = True, False
                return
        self.is_silent = True
        raise self.line.silence()

    def _greet(self) -> None:
        """Ask for the connection, as a projector on a network wants it."""
        self.line.send(_GREETING)
        answer = self.line.take(len(_GREETING), self.line.deadline_ns(_ANSWER_S))
        if answer is None:
            raise self.line.silence()
        if not answer.startswith(_GREETING[:10]) or answer[_STATUS_BYTE] != _WELCOME:
            raise DeviceProtocolError(
                f"the projector at {self.line.address.name} refuses the connection",
                subject="projector",
                remedy="allow control over the network without a password in its menu",
            )

    def _is_probe_answered(self, deadline_ns: int) -> bool:
        """What an earlier command left, or noise, may come before the colon."""
        try:
            while self._answer(deadline_ns):
                continue
        except (DeviceTimeout, DeviceProtocolError):
            return False
        return True

    def _misunderstood(self, answer: str) -> DeviceProtocolError:
        self._is_in_step = False
        return DeviceProtocolError(
            f"the projector answers {answer[:60]!r}",
            subject="projector",
            remedy="check the cable and that the device speaks ESC/VP21",
        )

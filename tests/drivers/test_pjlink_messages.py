import pytest

from drivers import pjlink_messages as messages
from drivers.interfaces import PowerState
from navapp.errors import DeviceProtocolError


def test_digest_is_the_documented_one() -> None:
    found = messages.compute_digest("498e4a67", "JBMIAProjectorLink")
    assert found == "5d8409bc1c3fa39749434aa3a5c38682"


def test_greetings() -> None:
    assert messages.salt_of("PJLINK 0") == ""
    assert messages.salt_of("PJLINK 1 498e4a67") == "498e4a67"


@pytest.mark.parametrize(
    "greeting",
    [
        "",
        "PJLINK",
        "PJLINK 0 498e4a67",
        "PJLINK 1",
        "PJLINK 1 498e4a6",
        "PJLINK 2 0123",
        "HTTP/1.1",
    ],
)
def test_other_greetings_are_refused(greeting) -> None:
    with pytest.raises(DeviceProtocolError, match="not PJLink class 1"):
        messages.salt_of(greeting)


@pytest.mark.parametrize("line", ["PJLINK ERRA", "pjlink erra"])
def test_a_refused_password_is_named_wherever_it_is_told(line) -> None:
    for take in (messages.salt_of, lambda line: messages.parse_reply(line, "POWR")):
        with pytest.raises(messages.PasswordRefused, match="refuses the password"):
            take(line)


def test_replies() -> None:
    assert messages.parse_reply("%1POWR=1", "POWR") == messages.Reply("1")
    assert messages.parse_reply("%1powr=ok", "POWR") == messages.Reply("ok")
    assert messages.parse_reply("%1NAME=", "NAME") == messages.Reply("")
    assert messages.parse_reply("%1INF1=ACME", "INF1") == messages.Reply("ACME")
    for error in ("ERR1", "ERR2", "ERR3", "ERR4"):
        assert messages.parse_reply(f"%1INPT={error}", "INPT") == messages.Reply("", error)


@pytest.mark.parametrize("line", ["", "%1POWR", "%2POWR=1", "%1AVMT=31", "POWR=1", "%1POWR=\x00"])
def test_other_replies_are_refused(line) -> None:
    with pytest.raises(DeviceProtocolError, match="to POWR"):
        messages.parse_reply(line, "POWR")


def test_values() -> None:
    states = [messages.parse_power_state(value) for value in "0123"]
    assert states == [
        PowerState.STANDBY, PowerState.ON, PowerState.COOLING, PowerState.WARMING
    ]  # fmt: skip
    hidden = {value for value in ("10", "11", "20", "21", "30", "31") if messages.is_hidden(value)}
    assert hidden == {"11", "31"}
    assert messages.parse_source("31") == "31"
    assert messages.parse_lamp_hours("1633 1 20 0") == (1633, 20)
    assert messages.parse_faults("000000") == ()
    assert messages.parse_faults("012001") == ("lamp warning", "temperature error", "other warning")


@pytest.mark.parametrize(
    ("read", "wrong"),
    [
        (messages.parse_power_state, ("", "4", "01", "on")),
        (messages.is_hidden, ("", "1", "32", "40")),
        (messages.parse_source, ("", "3", "60", "10", "311")),
        (
            messages.parse_lamp_hours,
            ("", "1633", "1633 2", "1633 1 20", "-5 1", "1 0" + " 1 0" * 8),
        ),
        (messages.parse_faults, ("", "00000", "000003", "0000000")),
    ],
)
def test_values_that_mean_nothing_are_refused(read, wrong) -> None:
    for value in wrong:
        with pytest.raises(DeviceProtocolError, match="cannot be read from"):
            read(value)

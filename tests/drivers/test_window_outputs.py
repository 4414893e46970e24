import pytest

from drivers.window_outputs import Output, choose_output
from navapp.errors import DeviceNotFound, WrongDevice

DESK = Output(0, 'DELL 24"', 0, 0, 1920, 1200)
PROJECTOR = Output(1, "EPSON PJ", 1920, 0, 1920, 1080)


def test_the_named_output_is_chosen() -> None:
    assert choose_output([DESK, PROJECTOR], "EPSON PJ", 1920, 1080) is PROJECTOR


def test_without_a_name_the_only_output_is_chosen() -> None:
    assert choose_output([PROJECTOR], "", 1920, 1080) is PROJECTOR


@pytest.mark.parametrize(
    ("found", "name", "text"),
    [
        ([DESK, PROJECTOR], "", r"several outputs.*DELL 24\".*EPSON PJ \(1920x1080\)"),
        ([PROJECTOR, PROJECTOR], "EPSON PJ", "'EPSON PJ' is not the only one"),
        ([DESK], "EPSON PJ", r"no output 'EPSON PJ'.*DELL 24\" \(1920x1200\)"),
        ([], "", "no output"),
    ],
)
def test_what_is_missing_or_ambiguous_is_refused_with_what_there_is(found, name, text) -> None:
    with pytest.raises(DeviceNotFound, match=text):
        choose_output(found, name, 1920, 1080)


def test_an_output_of_another_size_is_refused() -> None:
    with pytest.raises(WrongDevice, match=r"EPSON PJ \(1920x1080\) has another size than 1280x720"):
        choose_output([PROJECTOR], "EPSON PJ", 1280, 720)

"""Packages as an installer leaves them, good ones and broken ones, found by Python itself."""

import os

import pytest

from drivers.clock import ManualClock
from navapp.devices.package_camera import make_package_camera
from navapp.errors import ConfigurationError, DeviceError, UsageError
from navapp.inventory import camera_packages
from navapp.inventory.camera_packages import InstalledCamera, list_installed
from tests.devices.package_cameras import install

GOOD = "def make(settings, clock): return settings, clock"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder that Python searches, in this process and its children."""
    monkeypatch.syspath_prepend(str(tmp_path))
    paths = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    return tmp_path


def put(site, package, name, source, module=None):
    module = module or f"{package}_driver"
    install(site, package, {name: f"{module}:make"}, {f"{module}.py": source})


def test_without_packages_there_are_none(site):
    assert list_installed().found == list_installed().unseen == ()


def test_a_broken_package_is_told_by_name_and_the_rest_is_listed(site):
    put(site, "acme", "camera.acme", GOOD)
    put(site, "beta", "camera.beta", "import beta_sdk")
    listing = list_installed()
    assert listing.found == (InstalledCamera("acme", "acme_driver:make", "acme 1.0"),)
    (why,) = listing.unseen
    assert why.subject == "camera.beta"
    assert why.problem == (
        "driver 'camera.beta' of the package beta 1.0 cannot be loaded "
        "(ModuleNotFoundError: No module named 'beta_sdk')"
    )


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("import os; os.write(2, b'segmentation fault'); os.abort()", "segmentation fault"),
        ("import os; os._exit(3)", "it ended with code 3"),
        ("raise SystemExit('no licence')", "no licence"),
        ("made = 1", "has no attribute 'make'"),
    ],
)
def test_whatever_a_package_does_when_it_is_loaded_is_told(site, source, words):
    put(site, "beta", "camera.beta", source)
    (why,) = list_installed().unseen
    assert words in why.problem


def test_a_package_that_prints_does_not_spoil_the_answer(site, capfd):
    put(site, "acme", "camera.acme", f"print('hello from acme')\n{GOOD}")
    assert len(list_installed().found) == 1
    assert capfd.readouterr().out == ""


def test_a_package_that_hangs_is_not_waited_for(site, monkeypatch):
    monkeypatch.setattr(camera_packages, "_LOADING_S", 0.5)
    put(site, "beta", "camera.beta", "import time; time.sleep(60)")
    (why,) = list_installed().unseen
    assert "it takes longer than" in why.problem


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lamp.acme", "of a kind that navapp does not know"),
        ("camera.opencv", "the name of one of navapp's own"),
    ],
)
def test_what_would_never_be_used_is_told(site, name, words):
    put(site, "acme", name, GOOD)
    listing = list_installed()
    assert listing.found == ()
    assert words in listing.unseen[0].problem


def test_of_two_packages_of_one_name_none_is_used(site):
    put(site, "acme", "camera.acme", GOOD)
    put(site, "copycat", "camera.acme", GOOD)
    listing = list_installed()
    assert listing.found == ()
    assert [why.problem.split()[5] for why in listing.unseen] == ["acme", "copycat"]
    with pytest.raises(ConfigurationError, match="2 installed packages bring a camera backend"):
        make_package_camera("acme", {}, ManualClock())


def test_a_factory_is_given_its_table_and_the_clock(site):
    put(site, "gamma", "camera.gamma", GOOD)
    clock = ManualClock()
    assert make_package_camera("gamma", {"port": 7}, clock) == ({"port": 7}, clock)


def test_a_factory_that_fails_is_one_sentence(site):
    put(site, "delta", "camera.delta", "def make(settings, clock): return settings['port']")
    with pytest.raises(DeviceError, match=r"'delta' cannot be loaded \(KeyError: 'port'\)"):
        make_package_camera("delta", {}, ManualClock())


def test_a_factory_may_refuse_its_settings_in_navapps_words(site):
    source = "from navapp.errors import UsageError\ndef make(s, c): raise UsageError('no port')"
    put(site, "epsilon", "camera.epsilon", source)
    with pytest.raises(UsageError, match="no port"):
        make_package_camera("epsilon", {}, ManualClock())

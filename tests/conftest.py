"""Shared by all tests: the user's settings hidden, leaks found, skips counted, knees kept."""

import gc
import itertools
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import hypothesis
import psutil
import pytest

import navapp  # sets the environment before any heavy import
from navapp.config import Configuration, load
from tests import compile_once, kept

assert navapp.__version__
kept.install()
compile_once.install()

DATA = Path(os.environ.get("NAVAPP_DATA", "../shared/data"))


@pytest.fixture(scope="session")
def _homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Names of folders that nothing has made yet, one for each test."""
    homes = tmp_path_factory.mktemp("homes")
    return (homes / str(n) for n in itertools.count())


@pytest.fixture(autouse=True)
def _own_settings(_homes: Iterator[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """No configuration of the person who runs the tests is found."""
    home = next(_homes)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(home / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(home / "state"))
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.fixture(autouse=True)
def _nothing_left_behind() -> Iterator[None]:
    """A test that leaves a thread of ours or a child process behind fails."""
    threads = set(threading.enumerate())
    children = {child.pid for child in _children()}
    yield
    left = [t for t in threading.enumerate() if t not in threads and not _lives_on(t)]
    for thread in left:
        thread.join(2.0)
    still = [t.name for t in left if t.is_alive()]
    new = [child for child in _children() if child.pid not in children]
    _, alive = psutil.wait_procs(new, timeout=2.0)
    assert not still, f"threads left behind: {still}"
    assert not alive, f"processes left behind: {alive}"


def _children() -> list[psutil.Process]:
    # psutil reads every process of the machine: too much for the many tests that start none.
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return []
    return psutil.Process().children(recursive=True)


def _lives_on(thread: threading.Thread) -> bool:
    # asyncio keeps its pool for the life of the loop, stereo its two threads for the process.
    return thread.name.startswith(("asyncio_", "ThreadPoolExecutor", "Dummy"))


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of recorded data; the test is skipped, and counted, without it."""
    if not DATA.is_dir():
        pytest.skip(f"no recorded data in {DATA} (set NAVAPP_DATA)")
    return DATA


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests that share what is made once for their module run in one worker: it is made there.

    Those that wait run in one as well: waiting in all workers at once, they leave the cores idle.
    Slow ones come first: what is left for the end is short, and no worker waits for another.
    """
    if not config.getoption("--release"):
        many = [item for item in items if item.get_closest_marker("release")]
        items[:] = [item for item in items if not item.get_closest_marker("release")]
        config.hook.pytest_deselected(items=many)
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: item.get_closest_marker("slow") is None)
    for item in items:
        if item.get_closest_marker("waits"):
            item.add_marker(pytest.mark.xdist_group("waits"))
        if not isinstance(item, pytest.Function) or item.get_closest_marker("xdist_group"):
            continue
        used = item._fixtureinfo.name2fixturedefs.values()
        if any(definitions[-1].scope == "module" for definitions in used):
            item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))


def pytest_collection_finish() -> None:
    """What is there now stays: the collector of garbage need not look through it every time.

    It also runs less often than by default.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)


def pytest_configure(config: pytest.Config) -> None:
    is_release = config.getoption("--release")
    hypothesis.settings.register_profile("few", max_examples=30)
    hypothesis.settings.register_profile("many", max_examples=150)
    hypothesis.settings.load_profile("many" if is_release else "few")
    if not is_release:
        # Snapshots of cases that run before a release only: nobody asks for them, they stay.
        config.option.warn_unused_snapshots = True
        if config.option.update_snapshots:
            raise pytest.UsageError("--snapshot-update needs --release: else it deletes snapshots")
    if config.getoption("--every-kernel"):
        from tests.kernels_run import EveryKernel

        config.pluginmanager.register(EveryKernel())


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--release",
        action="store_true",
        help="also what is marked as release: further cases, and slow tests of what others show",
    )
    parser.addoption(
        "--every-kernel",
        action="store_true",
        help="fail when a compiled kernel of the product was not run",
    )
    parser.addoption(
        "--hardware",
        metavar="FILE",
        help="also run the contracts on the devices of this configuration",
    )


@pytest.fixture
def empty_plots(monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config) -> None:
    """Plots are made and not drawn, which takes half a second each; before a release they are."""
    if pytestconfig.getoption("--release"):
        return

    def write(_figure: object, file: TextIO, **_options: object) -> None:
        file.write("<svg></svg>")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", write)


@pytest.fixture
def hardware(request: pytest.FixtureRequest) -> Configuration:
    """What names the connected devices; the test is skipped, and counted, without it."""
    path = request.config.getoption("--hardware")
    if path is None:
        pytest.skip("no hardware (name it with --hardware FILE)")
    return load(Path(path))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say how much was skipped: a silent skip looks like a pass."""
    skipped = terminalreporter.stats.get("skipped", [])
    without_data = sum("NAVAPP_DATA" in str(report.longrepr) for report in skipped)
    without_hardware = sum("--hardware" in str(report.longrepr) for report in skipped)
    without_peers = sum("make peers" in str(report.longrepr) for report in skipped)
    terminalreporter.write_line(
        f"skipped: {len(skipped)} tests, {without_data} of them for want of recorded data, "
        f"{without_hardware} for want of hardware, {without_peers} for want of the peers"
    )

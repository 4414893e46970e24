"""Processes that do jobs, and what becomes of them."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path

import psutil
import pytest

from drivers.child_python import make_child_environment
from navapp.errors import InputError, NavappError
from navapp.evaluation.workers import run_in_processes
from tests.evaluation import jobs

pytestmark = pytest.mark.waits


@pytest.fixture(scope="module", autouse=True)
def _tracker() -> Iterator[None]:
    """Python's own process, that stays until the end once the first other one was begun."""
    resource_tracker.ensure_running()
    yield
    resource_tracker._resource_tracker._stop()


def test_all_jobs_are_done_by_other_processes(tmp_path) -> None:
    done = list(run_in_processes(partial(jobs.note, tmp_path), range(5), 2))
    assert sorted(done) == list(range(5))
    processes = {(tmp_path / f"{number}").read_text() for number in range(5)}
    assert 1 <= len(processes) <= 2
    assert str(psutil.Process().pid) not in processes
    assert list(run_in_processes(partial(jobs.note, tmp_path), [], 2)) == []


def test_what_a_job_says_comes_as_it_is_and_what_was_done_stays(tmp_path) -> None:
    with pytest.raises(InputError, match=r"^number 2 is damaged: delete it$") as told:
        list(run_in_processes(partial(jobs.fail_at_two, tmp_path), range(200), 1))
    assert told.value.subject == "2"
    assert {"0", "1"} <= {path.name for path in tmp_path.iterdir()}
    assert len(list(tmp_path.iterdir())) < 199, "what is not begun is left"


def test_a_killed_process_is_told_in_a_sentence(tmp_path) -> None:
    with pytest.raises(
        NavappError, match="was killed; what is done is kept: run again, with fewer"
    ):
        list(run_in_processes(partial(jobs.die_at_two, tmp_path), range(9), 1))


@pytest.mark.parametrize("how", ["interrupted", "killed"])
def test_no_process_outlives_the_one_that_began_it(tmp_path, how) -> None:
    code = f"""
if __name__ == "__main__":
    import signal
    # What runs in the background of a shell has it ignored, and all that it begins as well.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    from functools import partial
    from pathlib import Path
    from navapp.evaluation.workers import run_in_processes
    from tests.evaluation import jobs
    list(run_in_processes(partial(jobs.sleep, Path({str(tmp_path)!r})), range(9), 2))
"""
    script = tmp_path / "script.py"
    script.write_text(code)
    parent = subprocess.Popen(
        [sys.executable, str(script)], env=make_child_environment(), text=True,
        stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    try:
        workers = [psutil.Process(int(read_when_there(tmp_path / name))) for name in "01"]
        if how == "interrupted":  # as a terminal does it: all of its processes
            os.killpg(parent.pid, signal.SIGINT)
            said = parent.communicate(timeout=60.0)[1]
            assert said.rstrip().endswith("KeyboardInterrupt")
            assert "SpawnProcess" not in said, "the workers have nothing to say"
    finally:
        parent.kill()
        parent.communicate()
    _, alive = psutil.wait_procs(workers, timeout=60.0)
    assert alive == []
    assert {path.name for path in tmp_path.iterdir()} == {"0", "1", "script.py"}


def test_who_takes_no_more_ends_them_at_once(tmp_path) -> None:
    done = run_in_processes(partial(jobs.sleep_but_first, tmp_path), range(9), 1)
    assert next(done) == 0
    read_when_there(tmp_path / "1")
    began_s = time.monotonic()
    done.close()
    assert time.monotonic() - began_s < 10.0
    with pytest.raises(ProcessLookupError):
        os.kill(int(read_when_there(tmp_path / "1")), 0)


def test_ctrl_c_works_again_afterwards(tmp_path) -> None:
    before = signal.getsignal(signal.SIGINT)
    assert list(run_in_processes(partial(jobs.note, tmp_path), [0], 1)) == [0]
    assert signal.getsignal(signal.SIGINT) is before


def read_when_there(path: Path) -> str:
    end_s = time.monotonic() + 30.0
    while not path.is_file() or not path.read_text():
        assert time.monotonic() < end_s, f"no {path.name}"
        time.sleep(0.02)
    return path.read_text()

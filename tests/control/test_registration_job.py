import threading

import pytest

from navapp.control.executors import InlineExecutor, ThreadExecutor
from navapp.control.registration_job import RegistrationJob
from navapp.control.stages import STAGES
from tests.control.fakes import a_frame, answer

OPENING = STAGES[0]


class Searching:
    """Stands for `Trackers`: answers when the gate is open."""

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.gate.set()
        self.error: Exception | None = None
        self.answers = [answer()]

    def register(self, stage, frame, on_progress):
        on_progress(0.5)
        assert self.gate.wait(10.0)
        if self.error is not None:
            raise self.error
        return self.answers


def test_the_result_is_handed_over_once_with_the_time_of_its_frame() -> None:
    searching = Searching()
    job = RegistrationJob(searching, InlineExecutor())
    frame = a_frame(captured_ns=77)
    assert job.progress is None
    assert job.take_due(0) is None
    assert job.start(OPENING, frame)
    found = job.take_due(0)
    assert found.answers == searching.answers
    assert found.captured_ns == 77
    assert job.take_due(1) is None


def test_one_search_runs_at_a_time() -> None:
    searching = Searching()
    executor = ThreadExecutor()
    job = RegistrationJob(searching, executor)
    searching.gate.clear()
    assert job.start(OPENING, a_frame())
    assert not job.start(OPENING, a_frame())
    assert job.progress in (0.0, 0.5)
    searching.gate.set()
    executor.close()
    assert job.take_due(0) is not None
    assert job.progress is None


def test_a_cancelled_search_is_never_handed_over_and_another_may_start() -> None:
    searching = Searching()
    executor = ThreadExecutor()
    job = RegistrationJob(searching, executor)
    searching.gate.clear()
    job.start(OPENING, a_frame())
    job.cancel()
    assert job.progress is None
    searching.gate.set()
    executor.close()
    assert job.take_due(0) is None
    assert job.start(OPENING, a_frame())
    executor.close()
    assert job.take_due(0) is not None


def test_what_the_search_raises_is_raised_where_its_result_is_taken() -> None:
    searching = Searching()
    searching.error = ZeroDivisionError("bug")
    job = RegistrationJob(searching, InlineExecutor())
    job.start(OPENING, a_frame())
    with pytest.raises(ZeroDivisionError):
        job.take_due(0)
    assert job.progress is None

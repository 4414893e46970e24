import threading

import pytest

from navapp.control.executors import (
    InlineExecutor,
    Job,
    JobCancelled,
    RecordedExecutor,
    ThreadExecutor,
)
from tests.control.fakes import wait_for


def test_an_inline_job_is_done_when_it_was_started() -> None:
    job: Job[int] = Job(lambda report: 7)
    executor = InlineExecutor()
    executor.start(job)
    assert executor.take_due(job, 0)
    assert job.result == 7


def test_a_job_keeps_its_error() -> None:
    def fail(report) -> int:
        raise KeyError("x")

    job: Job[int] = Job(fail)
    InlineExecutor().start(job)
    assert isinstance(job.error, KeyError)
    assert job.result is None
    assert job.is_finished


def test_a_worker_is_due_when_it_has_finished() -> None:
    gate = threading.Event()
    job: Job[bool] = Job(lambda report: gate.wait(10.0))
    executor = ThreadExecutor()
    executor.start(job)
    assert not executor.take_due(job, 10**6)
    gate.set()
    wait_for(lambda: executor.take_due(job, 0), "the worker")
    assert job.result is True
    executor.close()
    assert not any(thread.name == "registration" for thread in threading.enumerate())


def test_a_cancelled_worker_stops_at_its_next_report() -> None:
    gate, reached = threading.Event(), []

    def work(report) -> None:
        report(0.25)
        gate.wait(10.0)
        report(0.5)
        reached.append("too far")

    job: Job[None] = Job(work)
    executor = ThreadExecutor()
    executor.start(job)
    job.cancel()
    gate.set()
    executor.close()
    assert isinstance(job.error, JobCancelled)
    assert job.is_cancelled
    assert reached == []


@pytest.mark.parametrize(("due", "first"), [([5], 5), ([0], 0)])
def test_a_recorded_job_is_handed_over_when_the_recording_did(due, first) -> None:
    executor = RecordedExecutor(due)
    job: Job[int] = Job(lambda report: 1)
    executor.start(job)
    assert [n for n in range(10) if executor.take_due(job, n)] == [first]


def test_recorded_jobs_are_handed_over_one_after_the_other() -> None:
    executor = RecordedExecutor([3, 8])
    jobs = [Job(lambda report: 1) for _ in range(2)]
    for job in jobs:
        executor.start(job)
    assert not executor.take_due(jobs[0], 2)
    assert executor.take_due(jobs[0], 3)
    assert not executor.take_due(jobs[1], 7)
    assert executor.take_due(jobs[1], 9)


def test_a_job_whose_result_the_recording_never_used_is_never_due() -> None:
    """It was cancelled: taken over all the same, it would bring a review that never was."""
    executor = RecordedExecutor([])
    job: Job[int] = Job(lambda report: 1)
    executor.start(job)
    assert not any(executor.take_due(job, n) for n in range(100))

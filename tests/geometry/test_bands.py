"""Two halves of a job."""

import threading

import pytest

from navapp.geometry.bands import beside, in_row_bands, run_both


def test_halves_of_halves_do_not_wait_for_each_other():
    done = []

    def quarter(name):
        return lambda: done.append(name)

    def half(name):
        return lambda: run_both(quarter(f"{name} upper"), quarter(f"{name} lower"))

    worker = threading.Thread(target=lambda: run_both(half("left"), half("right")), daemon=True)
    worker.start()
    worker.join(20.0)
    assert not worker.is_alive()
    assert sorted(done) == ["left lower", "left upper", "right lower", "right upper"]


def test_the_first_error_is_raised_after_both_have_ended():
    ended = []

    def fails():
        raise ValueError("upper")

    with pytest.raises(ValueError, match="upper"):
        run_both(fails, lambda: ended.append("lower"))
    assert ended == ["lower"]


@pytest.mark.parametrize("height", [0, 1, 7, 16, 40, 41])
def test_bands_cover_every_row_once(height):
    rows = []
    in_row_bands(height, lambda first, last: rows.extend(range(first, last)))
    assert sorted(rows) == list(range(height))


@pytest.mark.parametrize("every", [1, 6, 8, 48])
def test_the_lower_half_begins_at_a_multiple(every):
    first_rows = []
    in_row_bands(200, lambda first, last: first_rows.append(first), every)
    assert max(first_rows) > 0
    assert all(first % every == 0 for first in first_rows)


def test_a_job_beside_runs_on_its_own_and_its_error_is_told():
    meeting = threading.Barrier(2, timeout=20.0)
    job = beside(lambda: (meeting.wait(), threading.current_thread().name)[1])
    meeting.wait()
    assert job.result() != threading.current_thread().name

    def fails():
        raise ValueError("beside")

    with pytest.raises(ValueError, match="beside"):
        beside(fails).result()


def test_a_job_that_the_helper_has_no_time_for_is_done_by_who_asks():
    is_over = threading.Event()
    busy = beside(lambda: is_over.wait(20.0))
    while not busy._begun.running():
        is_over.wait(0.001)
    waiting = beside(lambda: threading.current_thread().name)
    assert waiting.result() == threading.current_thread().name
    is_over.set()
    assert busy.result()


def test_halves_of_a_job_beside_do_not_wait_for_others():
    done = []
    jobs = [
        beside(lambda: run_both(lambda: done.append("a"), lambda: done.append("b")))
        for _ in range(4)
    ]
    for job in jobs:
        job.result()
    assert sorted(done) == ["a"] * 4 + ["b"] * 4


def test_the_helper_does_what_it_begins_beside():
    meeting = threading.Barrier(2, timeout=20.0)

    def job():
        meeting.wait()
        here = threading.current_thread().name
        return here, beside(lambda: threading.current_thread().name).result()

    begun = beside(job)
    meeting.wait()
    name, inner = begun.result()
    assert inner == name != threading.current_thread().name


def test_an_error_of_what_it_does_itself_is_told_as_well():
    def fails():
        raise ValueError("inner")

    with pytest.raises(ValueError, match="inner"):
        beside(lambda: beside(fails).result()).result()

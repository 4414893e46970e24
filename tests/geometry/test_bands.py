"""Two halves of a job."""

import threading
import time
from contextlib import ExitStack

import pytest

from navapp.geometry.bands import begin_on_helper, in_row_bands, map_both, run_both


def fails_as(name):
    def fails():
        raise ValueError(name)

    return fails


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


def test_the_first_error_is_raised_after_both_have_ended() -> None:
    begun, ended = threading.Event(), []

    def lower() -> None:
        begun.set()
        time.sleep(0.05)
        ended.append("lower")

    def upper() -> None:
        assert begun.wait(10.0)
        raise ValueError("upper")

    with pytest.raises(ValueError, match="upper"):
        run_both(upper, lower)
    assert ended == ["lower"]
    with pytest.raises(ValueError, match="lower"):
        run_both(lambda: None, fails_as("lower"))


def test_both_answers_are_given() -> None:
    assert run_both(lambda: 1, lambda: "two") == (1, "two")


@pytest.mark.parametrize("height", [0, 1, 7, 16, 40, 41])
def test_bands_cover_every_row_once(height):
    rows = []
    in_row_bands(height, lambda band: rows.extend(range(*band)))
    assert sorted(rows) == list(range(height))


@pytest.mark.parametrize("every", [1, 6, 8, 48])
@pytest.mark.parametrize("middle", [None, 60, 199])
def test_the_lower_half_begins_at_a_multiple(every, middle):
    bands = []
    in_row_bands(200, bands.append, every, middle)
    (first, begin), (again, last) = sorted(bands)
    assert (first, last) == (0, 200)
    assert begin == again
    assert begin % every == 0
    assert 0 <= (100 if middle is None else middle) - begin < every


def test_a_job_beside_runs_on_its_own_and_its_error_is_told():
    meeting = threading.Barrier(2, timeout=20.0)
    with begin_on_helper(lambda: (meeting.wait(), threading.current_thread().name)[1]) as job:
        meeting.wait()
        assert job.result() != threading.current_thread().name
    with pytest.raises(ValueError, match="beside"), begin_on_helper(fails_as("beside")) as job:
        job.result()


def test_a_job_that_the_helper_has_no_time_for_is_done_by_who_asks():
    is_over = threading.Event()
    with begin_on_helper(lambda: is_over.wait(20.0)) as busy:
        while not busy._begun.running():
            is_over.wait(0.001)
        with begin_on_helper(lambda: threading.current_thread().name) as waiting:
            assert waiting.result() == threading.current_thread().name
        is_over.set()
        assert busy.result()


def test_a_job_beside_is_done_once_whoever_does_it():
    done = []
    with begin_on_helper(lambda: done.append("outer")) as job:
        pass
    job.result()

    def inner():
        with begin_on_helper(lambda: done.append("inner")) as one:
            one.result()
        one.result()

    with begin_on_helper(inner) as outer:
        outer.result()
    assert done == ["outer", "inner"]


def test_an_error_that_nobody_asked_for_is_told_at_the_end():
    with pytest.raises(ValueError, match="beside"), begin_on_helper(fails_as("beside")):
        pass


def test_a_job_beside_is_over_when_the_block_fails():
    begun, let_go, ended = threading.Event(), threading.Event(), []

    def job():
        begun.set()
        let_go.wait(20.0)
        ended.append("job")
        raise ValueError("job")

    def block():
        assert begun.wait(20.0)
        threading.Timer(0.05, let_go.set).start()
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), begin_on_helper(job):
        block()
    assert ended == ["job"]


def test_a_job_that_has_not_begun_when_the_block_fails_never_runs():
    let_go, done = threading.Event(), []
    with begin_on_helper(lambda: let_go.wait(20.0)):
        with pytest.raises(ZeroDivisionError), begin_on_helper(lambda: done.append("job")):
            raise ZeroDivisionError
        let_go.set()
    run_both(lambda: None, lambda: None)
    assert done == []


def test_halves_of_a_job_beside_do_not_wait_for_others():
    done = []
    with ExitStack() as stack:
        for _ in range(4):
            stack.enter_context(
                begin_on_helper(
                    lambda: run_both(lambda: done.append("a"), lambda: done.append("b"))
                )
            )
    assert sorted(done) == ["a"] * 4 + ["b"] * 4


def test_the_helper_does_what_it_begins_beside():
    meeting = threading.Barrier(2, timeout=20.0)

    def job():
        meeting.wait()
        with begin_on_helper(lambda: threading.current_thread().name) as inner:
            return threading.current_thread().name, inner.result()

    with begin_on_helper(job) as begun:
        meeting.wait()
        name, inner = begun.result()
    assert inner == name != threading.current_thread().name


def test_an_error_of_what_it_does_itself_is_told_as_well():
    def job():
        with begin_on_helper(fails_as("inner")):
            pass

    with pytest.raises(ValueError, match="inner"), begin_on_helper(job) as outer:
        outer.result()


def test_who_asks_while_another_does_the_job_waits_for_its_answer():
    is_busy, let_go, done = threading.Event(), threading.Event(), []

    def slow():
        done.append(threading.current_thread().name)
        is_busy.set()
        let_go.wait(20.0)
        return len(done)

    with ExitStack() as stack:
        held = stack.enter_context(begin_on_helper(lambda: let_go.wait(20.0)))
        while not held._begun.running():
            let_go.wait(0.001)
        job = stack.enter_context(begin_on_helper(slow))
        answers = []
        askers = [threading.Thread(target=lambda: answers.append(job.result())) for _ in range(2)]
        for asker in askers:
            asker.start()
        assert is_busy.wait(20.0)
        let_go.set()
        for asker in askers:
            asker.join(20.0)
    assert answers == [1, 1]


def test_errors_of_a_dropped_job_are_nobodys():
    begun = threading.Event()

    def fails():
        begun.set()
        raise ValueError("job")

    job = begin_on_helper(fails)
    assert begun.wait(20.0)
    job.drop()


def test_both_threads_map_items_in_order_and_tell_how_far_they_are():
    threads, told = set(), []

    def square(number):
        threads.add(threading.get_ident())
        time.sleep(0.01)
        return number * number

    assert map_both(square, range(7), told.append) == [n * n for n in range(7)]
    assert len(threads) == 2
    assert told == [0.0, 2 / 7, 4 / 7, 6 / 7, 1.0]
    assert map_both(square, [], told.append) == []


def test_what_progress_raises_stops_the_map():
    done = []
    with pytest.raises(ZeroDivisionError):
        map_both(done.append, range(1000), lambda fraction: 1 / 0)
    assert 0 not in done

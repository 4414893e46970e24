"""Tasks are ticked in their order, and stay ticked."""

from navapp.ui.tutorial.guide import Guide, Task


def make_guide() -> Guide[int]:
    tasks: tuple[Task[int], ...] = (
        Task("first", "past one", lambda number: number > 1),
        Task("second", "past two", lambda number: number > 2),
        Task("third", "even", lambda number: number % 2 == 0),
    )
    return Guide(tasks, "leave")


def test_a_task_is_ticked_when_a_snapshot_shows_it() -> None:
    guide = make_guide()
    assert (guide.now, guide.last_reached, guide.n_reached) == ("first", "", 0)
    guide.observe(1)
    assert guide.n_reached == 0
    guide.observe(2)
    assert (guide.now, guide.last_reached, guide.n_reached) == ("second", "past one", 1)


def test_one_snapshot_may_show_several_tasks_and_none_is_taken_back() -> None:
    guide = make_guide()
    guide.observe(4)
    assert guide.is_complete
    assert guide.now == "leave"
    assert guide.last_reached == "even"
    guide.observe(0)
    assert guide.is_complete


def test_no_task_is_ticked_before_those_in_front_of_it() -> None:
    guide = make_guide()
    guide.observe(0)
    assert guide.n_reached == 0

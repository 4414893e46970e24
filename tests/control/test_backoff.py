from navapp.control.backoff import Backoff


def test_pauses_double_up_to_the_longest_and_reset() -> None:
    pauses = Backoff(0.5, 3.0)
    assert [pauses.next_pause_s() for _ in range(5)] == [0.5, 1.0, 2.0, 3.0, 3.0]
    pauses.reset()
    assert [pauses.next_pause_s() for _ in range(2)] == [0.5, 1.0]

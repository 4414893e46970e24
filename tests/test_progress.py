from navapp.values.progress import tell_part


def test_a_part_tells_its_fraction_as_one_of_the_whole() -> None:
    told: list[float] = []
    outer = tell_part(told.append, 0.5, 1.0)
    inner = tell_part(outer, 0.0, 0.5)
    for fraction in (0.0, 0.5, 1.0):
        inner(fraction)
    assert told == [0.5, 0.625, 0.75]

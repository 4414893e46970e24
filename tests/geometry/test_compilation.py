"""Kernels that are compiled are counted and named, others are not."""

import numba

from navapp.geometry.compilation import watch_compilation


def make_kernel():
    def doubled_length(number):
        return number + number

    return numba.njit(doubled_length)


def test_a_kernel_is_told_when_it_is_compiled_and_not_again():
    kernel, told = make_kernel(), []
    with watch_compilation(
        lambda count, name: told.append((count, name, compilation.is_running))
    ) as compilation:
        assert kernel(2) == 4
        assert not compilation.is_running
    assert told == [(1, "doubled_length", True)]
    assert compilation.count == 1
    with watch_compilation() as compilation:
        assert kernel(3) == 6
    assert compilation.count == 0


def test_nothing_is_counted_after_the_watch():
    with watch_compilation() as compilation:
        pass
    assert make_kernel()(2) == 4
    assert compilation.count == 0

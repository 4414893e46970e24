"""How far a long work is: a function that is told the fraction done, and may raise to stop it."""

from collections.abc import Callable

Progress = Callable[[float], None]


def tell_part(on_progress: Progress, begin: float, end: float) -> Progress:
    """What a part of the work tells as its own fraction is told as one of the whole."""
    return lambda fraction: on_progress(begin + fraction * (end - begin))

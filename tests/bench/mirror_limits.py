"""Figures beside their limits, as rows of a table."""


class Limits:
    """Counts what is missed."""

    def __init__(self) -> None:
        self.n_missed = 0

    def line(self, name: str, value: float, limit: float, is_upper: bool = True) -> None:
        """One row of the table."""
        is_good = value <= limit if is_upper else value >= limit
        self.n_missed += not is_good
        print(f"| {name} | {value:.3f} | {'<=' if is_upper else '>='} {limit:g} "
              f"| {'' if is_good else 'MISSED'} |", flush=True)  # fmt: skip

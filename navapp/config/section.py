"""What every table of the configuration has in common: frozen, unknown keys refused."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Pixels = Annotated[int, Field(gt=0)]


def check_rising(values: tuple[float, float]) -> tuple[float, float]:
    """A pair of numbers as it is.

    Raises:
        ValueError: the first is not smaller than the second.
    """
    if values[0] >= values[1]:
        raise ValueError("the first must be smaller than the second")
    return values


class Section(BaseModel):
    """One table of the file."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

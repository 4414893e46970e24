from typing import get_args

import pytest

from navapp.config import SimulationSection
from navapp.errors import UsageError
from sim_devices.scenario import Scenario


@pytest.mark.parametrize(
    "values",
    [
        {"seed": -1},
        {"side": "middle"},
        {"sex": "other"},
        {"age_group": "ancient"},
        {"cartilage_mm": -0.1},
        {"cartilage_mm": 2.7},
        {"cartilage_mm": float("nan")},
        {"motion": "dance"},
        {"instrument": "saw"},
        {"contrast": 0.3},
        {"blood": 1.1},
        {"drift_mm_s": 300.5},
        {"shake_mm": 5.1},
        {"shake_hz": -8.5},
        {"highlights": 33.5},
        {"distance_mm": 199.5},
        {"distance_mm": 1000.5},
    ],
)
def test_an_impossible_scenario_is_refused_in_our_words(values):
    (value,) = values.values()
    with pytest.raises(UsageError, match=f"{value}|negative"):
        Scenario(**values)


def test_what_the_configuration_allows_the_simulator_can_do():
    fields = SimulationSection.model_fields
    for name in ("side", "sex", "age_group", "motion", "instrument"):
        for value in get_args(fields[name].annotation):
            Scenario(**{name: value})
    highest = next(limit.le for limit in fields["cartilage_mm"].metadata if hasattr(limit, "le"))
    assert Scenario(cartilage_mm=highest).cartilage_mm == 2.6
    for name in (
        "drift_mm_s", "shake_mm", "shake_hz", "contrast", "blood", "highlights", "distance_mm",
    ):  # fmt: skip
        highest = next(limit.le for limit in fields[name].metadata if hasattr(limit, "le"))
        assert getattr(Scenario(**{name: highest}), name) == highest
        assert fields[name].default == getattr(Scenario(), name) or name == "drift_mm_s"
    lowest = next(one.ge for one in fields["distance_mm"].metadata if hasattr(one, "ge"))
    assert Scenario(distance_mm=lowest).distance_mm == lowest

"""Who looks at all the knees does so in one worker: they are made there."""

import pytest

from sim_devices.anatomy import KneeAnatomy
from tests.many import few_of
from tests.preop.knees import knees


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if isinstance(item, pytest.Function) and getattr(item.module, "knees", None) is knees:
            item.add_marker(pytest.mark.xdist_group("knees"))


@pytest.fixture(params=few_of([6, 20]), ids="{} knees".format, scope="package")
def people(request: pytest.FixtureRequest) -> list[KneeAnatomy]:
    """Both knees of three people, or of all."""
    return knees()[: request.param]

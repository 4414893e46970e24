"""Rigs that a session may not begin with."""

import dataclasses
from datetime import date

import pytest

from navapp.cli.headless import check_not_expired
from navapp.errors import RigError
from navapp.geometry import RigQuality
from tests.geometry.shapes import toed_in_rig

RIG = dataclasses.replace(
    toed_in_rig(), quality=RigQuality(True, expires_on=date(2026, 8, 28)), name="bench"
)


def test_an_expired_rig_is_refused_in_one_sentence() -> None:
    with pytest.raises(RigError, match="rig bench expired on 2026-08-28: calibrate again"):
        check_not_expired(RIG, date(2026, 8, 29))


@pytest.mark.parametrize("rig", [RIG, toed_in_rig()])
def test_a_rig_in_its_time_or_without_one_is_used(rig) -> None:
    check_not_expired(rig, date(2026, 8, 28))

"""Paths and choice against the definitions."""

import numpy as np
import pytest

from navapp.geometry.lane_kernels import WHOLE_LANES, lanes_for
from navapp.stereo.matching.census_kernels import census_rows
from navapp.stereo.matching.choice_kernels import Choice, choose_rows
from navapp.stereo.matching.sgm_kernels import (
    MAX_PENALTY,
    NONE,
    Views,
    jump_penalties,
    keep_rows,
    mirror_codes,
    new_paths,
    surplus_dtype,
)
from tests.reference import sgm_reference as reference

HEIGHT, WIDTH, RIGHT_WIDTH = 9, 13, 16
EDGE_GREY, NO_PARTNER = 6, 12
SMALL, LARGE = (2, 11), (60, 190)


def pictures() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    left = rng.integers(0, 60, (HEIGHT, WIDTH), dtype=np.uint8)
    right = rng.integers(0, 60, (HEIGHT, RIGHT_WIDTH), dtype=np.uint8)
    right[:, 1:12] = left[:, 2:]
    return left, right


def views_of(first_partner: int, count: int, p1: int, p2: int) -> Views:
    n = lanes_for(count, WHOLE_LANES)
    codes = []
    for image in pictures():
        codes.append(np.empty((HEIGHT, 3, image.shape[1]), dtype=np.uint8))
        census_rows(np.pad(image, 2, mode="edge"), 2, 2, (0, HEIGHT), codes[-1])
    return Views(
        codes[0],
        mirror_codes(codes[1], n),
        pictures()[0],
        first_partner,
        np.uint8(p1),
        jump_penalties(p1, p2, EDGE_GREY),
        np.uint8(NO_PARTNER),
        np.pad(np.zeros(RIGHT_WIDTH, dtype=np.uint8), n, constant_values=NONE),
        np.where(np.arange(n) < count, 0, NONE).astype(np.uint8),
    )


def cost_of(first_partner: int, count: int) -> np.ndarray:
    codes = [reference.census(np.pad(image, 2, mode="edge"), 2, 2) for image in pictures()]
    return reference.matching_cost(*codes, first_partner, count, NO_PARTNER)


@pytest.mark.kernel
@pytest.mark.parametrize("penalties", [SMALL, LARGE])
@pytest.mark.parametrize(
    ("first_partner", "count"), [(4, 5), (0, 32), (-2, 5), (12, 40), (70, 5), (-50, 40)]
)
def test_each_scan_adds_what_the_definition_says(first_partner, count, penalties) -> None:
    cost, grey = cost_of(first_partner, count), pictures()[0]
    views, n = views_of(first_partner, count, *penalties), lanes_for(count, WHOLE_LANES)
    for directions, rows, direction in (
        (reference.DOWN, (0, HEIGHT), 1),
        (reference.UP, (HEIGHT - 1, -1), -1),
    ):
        kept = np.empty((HEIGHT, WIDTH, n), dtype=surplus_dtype(penalties[1]))
        keep_rows(views, new_paths(WIDTH, n), rows, direction, kept)
        expected = reference.surplus(cost, grey, directions, *penalties, EDGE_GREY)
        assert (kept[:, :, :count] == expected).all()


@pytest.mark.kernel
@pytest.mark.parametrize("middle", [0, 4, HEIGHT])
@pytest.mark.parametrize("penalties", [SMALL, LARGE])
@pytest.mark.parametrize(
    ("first_partner", "count"), [(4, 5), (0, 32), (-2, 5), (12, 40), (70, 5), (-50, 40)]
)
def test_the_choice_agrees_with_the_definitions(first_partner, count, penalties, middle) -> None:
    views, n = views_of(first_partner, count, *penalties), lanes_for(count, WHOLE_LANES)
    shape = (HEIGHT, WIDTH)
    left_px, unique = (np.empty(shape, dtype=np.float32) for _ in range(2))
    choice = Choice(left_px, np.empty((HEIGHT, RIGHT_WIDTH), dtype=np.float32), unique, 7, count)
    kept = np.empty((*shape, n), dtype=surplus_dtype(penalties[1]))
    down, up = new_paths(WIDTH, n), new_paths(WIDTH, n)
    keep_rows(views, down, (0, middle), 1, kept)
    keep_rows(views, up, (HEIGHT - 1, middle - 1), -1, kept)
    choose_rows(views, down, (middle, HEIGHT), 1, kept, choice)
    choose_rows(views, up, (middle - 1, -1), -1, kept, choice)
    total = reference.aggregate(cost_of(first_partner, count), pictures()[0], *penalties, EDGE_GREY)
    for found, known in zip(
        (left_px, choice.right_px, unique),
        reference.choose(total, first_partner, 7, RIGHT_WIDTH),
        strict=True,
    ):
        np.testing.assert_allclose(found, known, rtol=1e-6)


def test_four_of_the_largest_jumps_fit() -> None:
    for p2, bits in ((63, 8), (64, 16), (MAX_PENALTY, 16)):
        held = np.iinfo(surplus_dtype(p2))
        assert held.bits == bits
        assert held.max >= 4 * p2


def test_a_jump_is_cheaper_across_an_edge_but_dearer_than_a_step() -> None:
    assert jump_penalties(6, 40, 8)[[0, 7, 8, 16, 255]].tolist() == [40, 40, 20, 13, 7]

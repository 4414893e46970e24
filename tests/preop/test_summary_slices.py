"""The slices of a plan's summary."""

import base64
import json
import re

import cv2
import numpy as np
import pytest

from navapp.preop import make_plan_view
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import DIRECTIONS, make_grid
from navapp.preop.summary_slices import make_slices_section, write_path
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere


def make_view(radius_mm=10.0, has_ct=True, name="femur", targets=()):
    mesh = sphere(radius_mm, 30)
    plan = Plan({name: BoneModel(name, mesh, "left")}, dict(targets))
    if not has_ct:
        return make_plan_view(plan)
    grid = make_grid([mesh])
    grey = np.random.default_rng(3).integers(40, 80, grid.size[::-1], dtype=np.uint8)
    return make_plan_view(plan, None, SliceVolume(grid, grey, (-200.0, 1400.0)))


def data_of(page):
    (text,) = re.findall(r'<script type="application/json" id="slice-data">(.*?)</script>', page)
    return json.loads(text)


def test_the_pictures_are_those_of_the_slices_that_they_say() -> None:
    view = make_view()
    for direction, told in zip(DIRECTIONS, data_of(make_slices_section(view))["directions"],
                               strict=True):  # fmt: skip
        assert tuple(told["marks"]) == direction.marks
        positions = [one["at_mm"] for one in told["slices"]]
        assert np.allclose(np.diff(positions), 2.0)
        assert len(positions) == view.grid.count_slices(direction) // 2
        one = told["slices"][7]
        (index,) = view.grid.find_slices(direction, np.full((1, 3), one["at_mm"]))
        picture = cv2.imdecode(
            np.frombuffer(base64.b64decode(one["jpeg"]), np.uint8), cv2.IMREAD_GRAYSCALE
        )
        expected = view.volume.slice_of(direction, int(index))
        assert picture.shape == expected.shape == tuple(told["size"][::-1])
        away = np.abs(picture.astype(int) - expected).mean()
        other = np.abs(picture.astype(int) - view.volume.slice_of(direction, int(index) + 1)).mean()
        assert away < 7 < 11 < other


def test_every_point_stands_in_the_nearest_shown_slice_of_each_direction() -> None:
    points = np.array([[4.0, -7.0, 11.0], [3.0, 2.0, 1.0], [0.0, 0.0, 300.0]])
    view = make_view(targets={"femur/entry": points})
    for direction, told in zip(DIRECTIONS, data_of(make_slices_section(view))["directions"],
                               strict=True):  # fmt: skip
        found = {
            name: (one["at_mm"], x, y) for one in told["slices"] for name, x, y in one["points"]
        }
        for k, point in enumerate(points[:2], 1):
            at_mm, x, y = found[f"femur/entry {k}"]
            assert abs(at_mm - point[direction.axis]) <= 1.0
            expected = view.grid.find_pixels(direction, point) + 0.5
            np.testing.assert_allclose((x, y), expected, atol=0.06)
        assert "femur/entry 3" not in found


def test_without_a_ct_contours_alone_are_shown_and_the_page_says_so() -> None:
    page = make_slices_section(make_view(has_ct=False))
    data = data_of(page)
    slices = data["directions"][0]["slices"]
    assert "contours alone" in page
    assert not any(one["jpeg"] for one in slices)
    assert any(one["contours"] for one in slices)
    assert "soft tissue" not in page.replace('<label hidden><input type="checkbox" id="soft"> '
                                             "soft tissue</label>", "")  # fmt: skip


def test_nothing_is_fetched_from_elsewhere_and_a_name_ends_no_script() -> None:
    page = make_slices_section(make_view(targets={"femur/</script><b>": np.zeros(3)}))
    assert re.findall(r"https?://[^\"]+", page) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert page.count("</script>") == 2
    names = {name for one in data_of(page)["directions"][0]["slices"] for name, *_ in one["points"]}
    assert names == {"femur/</script><b>"}


def test_a_name_of_a_bone_is_no_markup() -> None:
    page = make_slices_section(make_view(name="a<i>"))
    assert "a<i>" not in page
    assert "a&lt;i&gt;" in page


@pytest.mark.slow
def test_the_page_of_a_large_noisy_volume_stays_small() -> None:
    mesh = sphere(85.0, 30)
    grid = make_grid([mesh])
    noise = np.random.default_rng(3).normal(60.0, 6.0, grid.size[::-1])
    volume = SliceVolume(grid, noise.astype(np.uint8), (-200.0, 1400.0))
    plan = Plan({"femur": BoneModel("femur", mesh, "left")})
    assert np.prod(grid.size) == 201**3
    assert len(make_slices_section(make_plan_view(plan, None, volume))) < 4_500_000


def test_a_contour_is_written_as_one_closed_line() -> None:
    square = np.array([[0, 0], [4, 0], [4, 3], [0, 3]], float)
    segments = np.stack([square, np.roll(square, -1, axis=0)], axis=1)
    shuffled = segments[[2, 0, 3, 1]]
    shuffled[1] = shuffled[1][::-1]
    path = write_path(shuffled)
    assert path.count("M") == 1
    start, steps = path[1:].split("l")
    walked = np.cumsum([list(map(int, start.split())),
                        *np.reshape(list(map(int, steps.split())), (-1, 2))], axis=0)  # fmt: skip
    assert {tuple(at) for at in walked.tolist()} == {(5, 5), (45, 5), (45, 35), (5, 35)}
    assert walked[0].tolist() == walked[-1].tolist()
    assert len(walked) == 5


def test_two_contours_are_two_lines_and_one_without_length_is_none() -> None:
    segments = np.array([[[0, 0], [1, 0]], [[5, 5], [6, 5]], [[2, 2], [2, 2]]], float)
    assert write_path(segments) == "M5 5l10 0M55 55l10 0"
    assert write_path(np.empty((0, 2, 2))) == ""

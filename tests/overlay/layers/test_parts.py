"""Implants and spacers."""

from dataclasses import replace

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.overlay.colours import PART
from navapp.values import Box, Part, SurgicalContent
from navapp.values.part_shapes import part_mesh
from tests.overlay.scenes import CAMERA, POSE, Occluder, draw, grown, scene, seen, words
from tests.views import find_silhouette


def part(z_mm: float) -> Part:
    place = RigidTransform.from_parts("femur", "tray", np.eye(3), (0.0, 0.0, z_mm))
    return Part("implant", Box((30.0, 20.0, 6.0)), place)


def given(z_mm: float):
    return seen(scene(content=SurgicalContent(parts={"tibial_tray": part(z_mm)})))


def test_a_part_before_the_bone_has_a_whole_outline_and_a_light_veil() -> None:
    image = draw("parts", given(-20.0))
    view = render(part_mesh(part(-20.0)), POSE, CAMERA)
    edge = find_silhouette(view)
    assert (image[edge][:, 1] > 0.7 * PART[1]).mean() > 0.97
    inner = view.mask & ~grown(edge, 4)
    veil = image[inner].max(axis=1)
    assert veil.min() > 10
    assert veil.max() < 0.5 * PART[0]
    assert not image[~grown(view.mask, 4)].any()


def test_within_the_bone_its_outline_is_in_stripes_and_its_veil_fainter() -> None:
    before, within = draw("parts", given(-20.0)), draw("parts", given(20.0))
    view = render(part_mesh(part(20.0)), POSE, CAMERA)
    edge = find_silhouette(view)
    is_strong = within[edge][:, 1] > 0.7 * PART[1]
    assert 0.3 < is_strong.mean() < 0.7
    inner = view.mask & ~grown(edge, 4)
    veil = within[inner].max(axis=1)
    assert veil.min() > 3
    nearer = render(part_mesh(part(-20.0)), POSE, CAMERA)
    inner = nearer.mask & ~grown(find_silhouette(nearer), 4)
    assert np.median(veil) < 0.7 * np.median(before[inner].max(axis=1))


def test_what_covers_the_bone_hides_it() -> None:
    hidden = seen(given(20.0), occluder=Occluder())
    assert not draw("parts", hidden).any()


def test_it_is_named() -> None:
    assert words("parts", given(-20.0)) == ["tibial tray"]
    away = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 3000.0, 400.0))
    assert words("parts", replace(given(-20.0), left_from_bone=away)) == []

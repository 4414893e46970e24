"""The bone, what is to be removed of it, and damaged cartilage."""

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.overlay.colours import CANDIDATE, DEFECT, GUIDE, REMOVAL_RAMP
from navapp.overlay.layers.bone import ramp_colours
from navapp.values import Defect, ResectionPlane, SurgicalContent
from tests.geometry.shapes import sphere
from tests.overlay.scenes import (
    CAMERA,
    HEIGHT,
    MESH,
    POSE,
    TARGET,
    WIDTH,
    Occluder,
    draw,
    grown,
    is_colour,
    panel_boxes,
    pixels_of,
    scene,
    seen,
    video,
)
from tests.views import find_silhouette

BEFORE = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, 400.0))
BALL = sphere(30.0, 32)
# Of the ball, what looks at the camera.
NEAR = SurgicalContent(
    planes={"cut": ResectionPlane("femur", np.array([0.0, 0.0, -18.0]), (0.0, 0.0, -1.0))}
)


class TestBone:
    def test_the_outline_runs_where_the_model_ends(self) -> None:
        image = draw("bone", seen(scene("bone")))
        view = render(MESH, POSE, CAMERA)
        edge = find_silhouette(view)
        assert (image[edge][:, 1] > 0.75 * GUIDE[1]).mean() > 0.99
        strong = image[..., 1] > 0.75 * GUIDE[1]
        assert not (strong & ~grown(edge, 2)).any()

    def test_the_veil_covers_the_model_and_nothing_else(self) -> None:
        before, image = video(), draw("bone", seen(scene("bone")), video())
        mask = render(MESH, POSE, CAMERA).mask
        changed = (image != before).any(axis=2)
        assert changed[mask].mean() > 0.99
        assert not (changed & ~grown(mask, 3)).any()
        inner = mask & ~grown(~mask, 4)
        # Light: what lies beneath can still be told.
        assert np.corrcoef(before[inner][:, 0], image[inner][:, 0])[0, 1] > 0.5

    def test_a_candidate_is_amber_and_what_is_accepted_green(self) -> None:
        for is_candidate, colour in ((True, CANDIDATE), (False, GUIDE)):
            image = draw("bone", seen(scene("bone", is_candidate=is_candidate)))
            assert is_colour(image, colour).sum() > 300


class TestRemoval:
    def test_the_ramp_goes_from_the_plane_to_its_last_colour(self) -> None:
        found = ramp_colours(np.array([-1.0, 0.0, 3.0, 15.0, 40.0]))
        for k, colour in ((0, 0), (1, 0), (2, 1), (3, -1), (4, -1)):
            np.testing.assert_allclose(found[k], REMOVAL_RAMP[colour], atol=1e-3)

    def test_deeper_bone_is_brighter_and_bone_that_stays_is_not_touched(self) -> None:
        image = draw("removal", seen(scene(mesh=BALL, pose=BEFORE, content=NEAR)))
        view = render(BALL, BEFORE, CAMERA)
        luma = image @ np.array([0.114, 0.587, 0.299])
        height_mm = 400.0 - 18.0 - view.depth_mm
        shown = np.zeros(luma.shape, dtype=bool)
        shown[100:380, 200:440] = True
        deep, shallow, stays = (
            shown & (height_mm > low) & (height_mm < high)
            for low, high in ((9.0, 13.0), (2.0, 5.0), (-12.0, -2.0))
        )
        assert min(deep.sum(), shallow.sum(), stays.sum()) > 200
        assert luma[deep].mean() > 1.2 * luma[shallow].mean() > 20.0
        assert not image[stays].any()
        assert not image[shown & ~view.mask].any()

    def test_its_colours_are_those_of_the_legend(self) -> None:
        image = draw("removal", seen(scene(mesh=BALL, pose=BEFORE, content=NEAR)))
        (taken,) = panel_boxes("removal", seen(scene(mesh=BALL, pose=BEFORE, content=NEAR)))
        assert taken.clip(WIDTH, HEIGHT) == taken
        luma = image[taken.slices][:, 10] @ np.array([0.114, 0.587, 0.299])
        # From much, at the top, to little; the title above it.
        ramp = luma[-125:-15]
        assert ramp[0] > ramp[-1] + 80.0
        assert (np.diff(ramp) < 1.0).all()
        outside = image.copy()
        outside[taken.slices] = 0
        assert not outside[:, taken.x - 5 :].any()

    def test_without_bone_beyond_the_plane_there_is_no_legend(self) -> None:
        plane = ResectionPlane("femur", np.array([0.0, 0.0, -31.0]), (0.0, 0.0, -1.0))
        none = SurgicalContent(planes={"cut": plane})
        assert not draw("removal", seen(scene(mesh=BALL, pose=BEFORE, content=none))).any()


class TestDefects:
    near = np.flatnonzero(np.linalg.norm(MESH.vertices_mm - TARGET, axis=1) < 12.0)

    def defects(self, vertices: np.ndarray) -> SurgicalContent:
        return SurgicalContent(defects={"worn": Defect("femur", vertices)})

    def test_dots_are_where_the_damage_is(self) -> None:
        image = draw("defects", seen(scene(content=self.defects(self.near))))
        dots = is_colour(image, DEFECT)
        u, v = pixels_of(MESH.vertices_mm[self.near]).T
        assert dots[v, u].all()
        assert dots.sum() <= 5 * len(self.near)
        assert not image[~dots].any()

    @pytest.mark.parametrize(("z_from_mm", "is_drawn"), [(-31.0, True), (8.0, False)])
    def test_the_far_side_is_not_shown(self, z_from_mm: float, is_drawn: bool) -> None:
        """A ball's far half is hidden by its near one."""
        vertices = np.flatnonzero(BALL.vertices_mm[:, 2] > z_from_mm)
        given = seen(scene(mesh=BALL, pose=BEFORE, content=self.defects(vertices)))
        assert draw("defects", given).any() == is_drawn

    def test_they_are_fainter_where_nothing_is_known_and_hidden_by_a_hand(self) -> None:
        given = scene(content=self.defects(self.near))
        u, v = pixels_of(MESH.vertices_mm[self.near]).T
        faint = draw("defects", given)[v, u, 2]
        assert (faint > 3).all()
        assert faint.max() < 0.7 * DEFECT[2]
        assert not draw("defects", seen(given, occluder=Occluder())).any()

"""Pixels of marks, and their slopes against numeric differences."""

import cv2
import numpy as np
import pytest

from calibration.rig.initial_rig import vector_of
from calibration.rig.parameters import N_COEFFICIENTS, RigModel, pack
from calibration.rig.projection import project
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pose, drawn_rig

POINTS_MM = BOARD.points_mm[::9] + np.linspace(-1.0, 1.0, 24).reshape(8, 3)


def numbers(n_coefficients: int) -> tuple[RigModel, np.ndarray, np.ndarray]:
    """A rig with every coefficient at work, and a pose of the board."""
    rng = np.random.default_rng(14)
    model = RigModel(n_coefficients, 0, WIDTH, HEIGHT)
    shared = pack(model, drawn_rig(rng))
    for number in range(2):
        first = number * model.n_camera + 8
        shared[first : first + n_coefficients - 4] += rng.normal(0.0, 0.02, n_coefficients - 4)
    return model, shared, vector_of(drawn_pose(rng).matrix)


def pixels_of(model, shared, pose, points_mm, number) -> np.ndarray:
    """(2n,) by plain matrices and OpenCV's lens, without any slope of it."""
    first = number * model.n_camera
    fx, fy, cx, cy, *distortion = shared[first : first + model.n_camera]
    seen = points_mm @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
    if number == 1:
        place = 2 * model.n_camera
        turn = cv2.Rodrigues(shared[place : place + 3])[0]
        seen = seen @ turn.T + shared[place + 3 : place + 6]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    nowhere = np.zeros(3)
    return cv2.projectPoints(seen, nowhere, nowhere, matrix, np.array(distortion))[0].ravel()


def differences(function, at: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(2n, len(at)) central differences."""
    columns = []
    for k, step in enumerate(steps):
        off = np.zeros(len(at))
        off[k] = step
        columns.append((function(at + off) - function(at - off)) / (2.0 * step))
    return np.column_stack(columns)


@pytest.mark.parametrize("number", [0, 1], ids=["left", "right"])
@pytest.mark.parametrize("n_coefficients", N_COEFFICIENTS)
def test_slopes_are_numeric_differences(n_coefficients: int, number: int) -> None:
    model, shared, pose = numbers(n_coefficients)
    pixels, by_rig, by_pose, by_point = project(POINTS_MM, pose, model, shared, number)
    np.testing.assert_allclose(
        pixels.ravel(), pixels_of(model, shared, pose, POINTS_MM, number), atol=1e-9
    )
    # Steps that move a pixel by some thousandths: pixels and mm, coefficients, radians.
    camera = [1e-3] * 4 + [1e-5] * n_coefficients
    steps = np.array([*camera, *camera, *[1e-6] * 3, *[1e-3] * 3])
    told = {
        "rig": (by_rig, lambda x: pixels_of(model, x, pose, POINTS_MM, number), shared, steps),
        "pose": (
            by_pose, lambda x: pixels_of(model, shared, x, POINTS_MM, number), pose, steps[-6:],
        ),
        "points": (
            by_point,
            lambda x: pixels_of(model, shared, pose, POINTS_MM + x, number),
            np.zeros(3), steps[-3:],
        ),
    }  # fmt: skip
    for name, (slopes, function, at, of) in told.items():
        expected = differences(function, at, of)
        assert slopes.shape == expected.shape
        size = np.maximum(np.abs(expected).max(axis=0), 1e-3)
        np.testing.assert_allclose(slopes / size, expected / size, atol=2e-6, err_msg=name)
    # The rig's numbers of the other camera move nothing.
    other = slice((1 - number) * model.n_camera, (2 - number) * model.n_camera)
    assert not by_rig[:, other].any()

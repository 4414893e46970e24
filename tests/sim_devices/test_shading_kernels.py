import numpy as np
import pytest

from sim_devices.materials import MaterialId, make_material_table
from sim_devices.shading_kernels import (
    compute_albedo,
    compute_light,
)
from tests.reference import shading_reference


@pytest.mark.kernel
@pytest.mark.parametrize("material", list(MaterialId))
def test_albedo_agrees_with_the_reference(material):
    rng = np.random.default_rng(3)
    table = make_material_table(0.05, 0.5)
    out = np.empty(5, np.float32)
    for _ in range(100):
        fine, coarse = rng.standard_normal((2, 5)).astype(np.float32)
        mark = np.float32(rng.uniform())
        compute_albedo(table, int(material), fine, coarse, mark, out)
        expected = shading_reference.albedo(table[material].astype(float), fine, coarse, mark)
        np.testing.assert_allclose(out, expected, rtol=2e-4, atol=2e-5)


@pytest.mark.kernel
def test_light_agrees_with_the_reference():
    rng = np.random.default_rng(4)
    out = np.empty(2, np.float32)
    seen_highlight = 0.0
    for _ in range(200):
        lamps = np.column_stack([rng.standard_normal((3, 3)), rng.uniform(0.1, 1.0, 3)])
        lamps[:, :3] /= np.linalg.norm(lamps[:, :3], axis=1, keepdims=True)
        normal = rng.standard_normal(3)
        normal /= np.linalg.norm(normal)
        point, eye = rng.uniform(-50, 50, 3), rng.uniform(200, 500, 3)
        single = [np.ascontiguousarray(value, np.float32) for value in (normal, point, eye)]
        compute_light(
            lamps[None].astype(np.float32), 0, *single, np.float32(0.2), np.float32(60.0), out
        )
        expected = shading_reference.light(lamps, normal, point, eye, 0.2, 60.0)
        np.testing.assert_allclose(out, expected, rtol=2e-3, atol=1e-5)
        seen_highlight = max(seen_highlight, float(out[1]))
    assert seen_highlight > 0.1

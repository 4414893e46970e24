"""Materials: contrast, blood and wet highlights as a scenario asks for them."""

import numpy as np
import pytest

from sim_devices.materials import MaterialId, make_material_table

SPECULAR, SHININESS = 16, 17


def test_wet_highlights_grow_with_their_area_on_what_is_wet():
    usual, large = make_material_table(0.05, 0.3), make_material_table(0.05, 0.3, 4.0)
    wet = [MaterialId.BONE, MaterialId.CARTILAGE, MaterialId.TISSUE]
    np.testing.assert_allclose(large[wet, SHININESS], usual[wet, SHININESS] / 4.0)
    dry = [MaterialId.DRAPE, MaterialId.STEEL, MaterialId.METAL, MaterialId.GLOVE]
    np.testing.assert_array_equal(large[dry], usual[dry])
    others = np.delete(np.arange(usual.shape[1]), SHININESS)
    np.testing.assert_array_equal(large[:, others], usual[:, others])


def test_a_matt_site_has_no_wet_highlights_and_steel_still_shines():
    matt = make_material_table(0.05, 0.3, 0.0)
    assert matt[MaterialId.BONE, SPECULAR] == matt[MaterialId.TISSUE, SPECULAR] == 0.0
    assert matt[MaterialId.STEEL, SPECULAR] > 0.0
    assert np.isfinite(matt).all()


def test_as_usual_nothing_changes():
    np.testing.assert_array_equal(
        make_material_table(0.05, 0.3, 1.0), make_material_table(0.05, 0.3)
    )
    assert make_material_table(0.05, 0.3)[MaterialId.BONE, SHININESS] == pytest.approx(170.0)

"""Drafts from labels: what a label leaves out is told."""

import numpy as np
import pytest

from navapp.preop.drafts import draft_from_labels
from navapp.preop.volume import LabelVolume


def labels_of(*balls) -> LabelVolume:
    """Of value 3, 1 mm voxels: each ball is x and radius."""
    z, y, x = np.mgrid[:40, :40, :80]
    mask = np.zeros(x.shape, dtype=bool)
    for middle, radius in balls:
        mask |= (x - middle) ** 2 + (y - 20.0) ** 2 + (z - 20.0) ** 2 < radius**2
    return LabelVolume(np.where(mask, 3, 0).astype(np.uint8), np.eye(4), np.ones(3))


def test_a_label_in_one_piece_says_nothing() -> None:
    assert draft_from_labels(labels_of((25.0, 15.0)), {"femur": 3}).origin.warnings == ()


def test_pieces_that_are_left_out_are_told() -> None:
    draft = draft_from_labels(labels_of((25.0, 15.0), (60.0, 5.0)), {"femur": 3})
    (said,) = draft.origin.warnings
    assert "femur: its label is in 2 separate pieces" in said
    share = float(said.split("without ")[1].split(" %")[0])
    assert share == pytest.approx(100.0 * 5.0**3 / (5.0**3 + 15.0**3), rel=0.1)
    assert draft.bones["femur"].mesh.vertices_mm[:, 0].max() < 45.0

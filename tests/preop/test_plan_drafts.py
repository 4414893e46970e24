"""Drafts from labels: what a label leaves out is told."""

import numpy as np
import pytest

from navapp.preop.plan_drafts import make_draft_from_labels
from navapp.preop.volume import LabelVolume


def labels_of(*balls) -> LabelVolume:
    """Of value 3, 1 mm voxels: each ball is x and radius."""
    z, y, x = np.mgrid[:40, :40, :80]
    mask = np.zeros(x.shape, dtype=bool)
    for middle, radius in balls:
        mask |= (x - middle) ** 2 + (y - 20.0) ** 2 + (z - 20.0) ** 2 < radius**2
    return LabelVolume(np.where(mask, 3, 0).astype(np.uint8), np.eye(4), np.ones(3))


def test_a_label_in_one_piece_says_nothing() -> None:
    assert make_draft_from_labels(labels_of((25.0, 15.0)), {"femur": 3}).origin.warnings == ()


def test_pieces_that_are_left_out_are_told() -> None:
    draft = make_draft_from_labels(labels_of((25.0, 15.0), (60.0, 5.0)), {"femur": 3})
    assert told_share(draft) == pytest.approx(5.0**3 / (5.0**3 + 15.0**3), rel=0.2)
    assert draft.bones["femur"].mesh.vertices_mm[:, 0].max() < 45.0


@pytest.mark.parametrize("joint", ["corner", "thread"])
def test_pieces_that_hardly_hang_together_are_told_as_well(joint) -> None:
    """What the surface leaves out counts, not what the voxels look like."""
    labels = np.zeros((40, 40, 70), np.uint8)
    labels[5:30, 5:30, 5:30] = 3
    if joint == "corner":
        labels[30:39, 30:39, 30:39] = 3
    else:
        labels[10:25, 10:25, 45:60] = 3
        labels[17, 17, 30:45] = 3
    draft = make_draft_from_labels(LabelVolume(labels, np.eye(4), np.ones(3)), {"femur": 3})
    n = (labels > 0).sum()
    assert told_share(draft) == pytest.approx(1.0 - 25.0**3 / n, rel=0.15)


def told_share(draft) -> float:
    (said,) = draft.origin.warnings
    assert "femur: its label is in separate pieces" in said
    return 0.01 * float(said.split("without ")[1].split(" %")[0])

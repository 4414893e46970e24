"""The file of a display in a mirror: it comes back whole, or is refused."""

import dataclasses
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.display_model import DisplayModel, DisplayQuality
from navapp.geometry.display_model_files import read_display_model, write_display_model
from tests.geometry.mirrored import display_of, site_points

QUALITY = DisplayQuality(
    False,
    ("held-out views fit badly",),
    0.21,
    1.7,
    date(2026, 3, 1),
    date(2026, 8, 28),
    {"held_out_mm": 0.12, "views_used": 8.0},
    np.diag(np.arange(1.0, 15.0)),
)


def model_of(**changes: object) -> DisplayModel:
    model = display_of(np.random.default_rng(21), bulge_mm=1.5, quality=QUALITY)
    return dataclasses.replace(
        model, other_eye_mm=model.eye_mm + 60.0, display_name="HDMI-1", mirror_deg=45.5,
        backend_flips=(False, True), projector_flips=(True, False), keystone=(0, -3), **changes,
    )  # fmt: skip


@pytest.fixture(params=["yml", "xml"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    write_display_model(tmp_path / f"display.{request.param}", model_of())
    return tmp_path / f"display.{request.param}"


def test_all_comes_back(path: Path) -> None:
    again, model = read_display_model(path), model_of()
    for field in ("display_name", "mirror_deg", "backend_flips", "projector_flips", "keystone",
                  "flips_columns", "flips_rows", "viewing_eye", "quality"):  # fmt: skip
        assert getattr(again, field) == getattr(model, field), field
    assert again.other_eye_mm is not None
    np.testing.assert_array_equal(again.other_eye_mm, model.other_eye_mm)
    assert again.quality is not None
    np.testing.assert_array_equal(again.quality.covariance, QUALITY.covariance)
    points = site_points(np.random.default_rng(22))
    np.testing.assert_allclose(again.project(points), model.project(points), atol=1e-9)


def test_what_is_not_known_comes_back_unknown(tmp_path: Path) -> None:
    model = display_of(np.random.default_rng(21), glass_mm=0.0)
    write_display_model(tmp_path / "display.yml", model)
    again = read_display_model(tmp_path / "display.yml")
    for field in ("glass", "other_eye_mm", "mirror_deg", "projector_flips", "keystone", "quality"):
        assert getattr(again, field) is None, field


EDITS = {
    "number": lambda text: text.replace("width_px", "width_px ", 1).replace("1920", "1921", 1),
    "verdict": lambda text: text.replace("accepted: 0", "accepted: 1").replace(
        "<accepted>0<", "<accepted>1<"
    ),
    "reason": lambda text: text.replace("fit badly", "fit well", 1),
    "hash removed": lambda text: "".join(text.splitlines(keepends=True)[:-1]),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edited_file_is_refused(path: Path, what: str) -> None:
    text = path.read_text(encoding="utf-8")
    edited = EDITS[what](text)
    assert edited != text
    path.write_text(edited, encoding="utf-8")
    with pytest.raises(InputError, match=r"display file .*: restore it"):
        read_display_model(path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist"),
        (b"hello", "damaged or not an OpenCV storage file"),
        (b"%YAML:1.0\n---\nK1: 3\n", "lacks origin"),
    ],
)
def test_files_that_are_none_are_refused(tmp_path: Path, content: bytes | None, said: str) -> None:
    path = tmp_path / "display.yml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_display_model(path)

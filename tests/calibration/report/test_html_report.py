"""The report: the numbers of the solve, a plot each, and nothing from elsewhere."""

import re
from dataclasses import replace
from datetime import date
from html.parser import HTMLParser

import numpy as np
import pytest

from calibration.report.html_report import make_page, write_report
from calibration.rig.acceptance import Limits
from calibration.rig.dropped_pairs import DroppedPair, Fault
from calibration.rig.rig_solution import Calibration, solve_rig
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_pairs, drawn_rig

VOID = {"meta", "br"}


@pytest.fixture(scope="module")
def found() -> Calibration:
    rng = np.random.default_rng(5)
    rig = drawn_rig(rng)
    return solve_rig(BOARD, drawn_pairs(rig, rng, 12, noise_px=0.02), (WIDTH, HEIGHT))


@pytest.fixture(scope="module")
def text(found: Calibration) -> str:
    return make_page(found, Limits())


class Reader(HTMLParser):
    """Tags that were never closed, words outside of them, and all that points elsewhere."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.pointers: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.pointers += [
            value or "" for key, value in attrs if re.search(r"(src|href|data|action)$", key)
        ]

    def handle_startendtag(self, tag, attrs) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data) -> None:
        self.words.append(" ".join(data.split()))


def test_the_numbers_of_the_solve_are_told(found, text) -> None:
    words = " ".join(Reader(text).words)
    ratios, bounds = 100.0 * found.length_ratios, found.bounds_mm
    model, shared = found.solved.model, found.solved.shared
    sigma = np.sqrt(np.diag(found.solved.covariance))
    for told in (
        f"{np.median(bounds):.2f} mm (middle), {np.quantile(bounds, 0.95):.2f} mm (nearly all)",
        "350 to 550 mm away; at most 0.40 mm",
        f"measured as {ratios.mean():.2f} ± {ratios.std():.2f} mm",
        f"{found.solved.rms_px:.3f} px {model.name}",
        f"rms on views not solved with {found.held_out_rms_px:.3f} px",
        f"{found.epipolar_rms_px:.3f} px rms",
        f"{len(found.pairs)} used, 0 not charuco of 11 x 8 squares, 15 mm",
        f"baseline {found.rig.baseline_mm:.3f} mm",
        f"left fx, px {shared[0]:.6g} ± {sigma[0]:.2g}",
        f"right cy, px {shared[model.n_camera + 3]:.6g} ± {sigma[model.n_camera + 3]:.2g}",
        f"translation x, mm {shared[model.n_rig - 3]:.6g} ± {sigma[model.n_rig - 3]:.2g}",
        f"left: {100 * found.covered.left:.0f} % covered",
        f"{found.covered.tilts_deg.max():.0f} deg at most",
        found.rig.rig_id,
    ):
        assert told in words, told


def test_every_plot_is_there_and_full(found, text) -> None:
    plots = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    uncertainty, residuals, views, epipolar, coverage = plots
    n_marks = sum(len(pair.left.ids) + len(pair.right.ids) for pair in found.pairs)
    n_common = sum(len(pair.common()[0]) for pair in found.pairs)
    assert "95 % error, mm" in uncertainty
    # An arrow for every mark, a dot for every mark, two bars for every pair.
    assert residuals.count("<path") >= n_marks
    assert coverage.count("<use") >= n_marks
    assert len(re.findall(r"<path [^>]*clip-path", views)) == 2 * len(found.pairs)
    assert 20 < len(re.findall(r"<path [^>]*clip-path", epipolar)) < n_common
    for plot, title in ((residuals, "the largest coordinate is"), (views, "held out")):
        assert title in plot


def test_it_is_one_file_without_anything_from_elsewhere(text) -> None:
    reader = Reader(text)
    assert reader.open == []
    assert [pointer for pointer in reader.pointers if not pointer.startswith("#")] == []
    assert re.findall(r"url\((?!#)|@import|<script|<link|<iframe", text) == []
    assert set(re.findall(r"https?://[^/\"]+", text)) <= {"http://www.w3.org"}


def test_an_accepted_rig_says_so_in_words(found, text) -> None:
    assert found.rig.quality is not None
    assert found.rig.quality.is_accepted, found.rig.quality.reasons
    words = " ".join(Reader(text).words)
    assert "Accepted. 95 % of points" in words
    assert "Not accepted" not in words
    assert "What this cannot see" in words


def judged(found: Calibration, **changes) -> Calibration:
    assert found.rig.quality is not None
    return replace(found, rig=replace(found.rig, quality=replace(found.rig.quality, **changes)))


@pytest.mark.usefixtures("empty_plots")
def test_a_refused_rig_says_why(found) -> None:
    reasons = ("only 6 pairs can be used, 8 are needed", "the board was shown frontally")
    text = make_page(judged(found, is_accepted=False, reasons=reasons), Limits())
    words = " ".join(Reader(text).words)
    assert f"Not accepted. {' '.join(reasons)}" in words
    assert "Accepted." not in words


@pytest.mark.usefixtures("empty_plots")
def test_what_a_user_named_is_escaped(found) -> None:
    name = '<script>alert("&")</script>'
    pair = DroppedPair(77, Fault.MOVED, f"moved {name}")
    named = replace(
        judged(found, is_accepted=False, reasons=(name,)), dropped=[*found.dropped, pair]
    )
    text = make_page(replace(named, rig=replace(named.rig, name=name)), Limits())
    words = " ".join(Reader(text).words)
    assert "<script" not in text
    assert f"Calibration of {name}" in words
    assert f"Not accepted. {name}" in words
    assert f"pair 77 moved {name}" in words


@pytest.mark.usefixtures("empty_plots")
def test_a_recorded_rig_says_when_it_ends(found) -> None:
    day = {"made_on": date(2026, 3, 1), "expires_on": date(2026, 8, 28)}
    words = " ".join(Reader(make_page(judged(found, **day), Limits())).words)
    assert "made on 2026-03-01 expires on 2026-08-28" in words


@pytest.mark.usefixtures("empty_plots")
def test_a_rig_without_a_common_volume_has_a_report_too(found) -> None:
    nothing = replace(
        judged(found, is_accepted=False, reasons=("no part",)),
        bounds_mm=np.empty(0), points_mm=np.empty((0, 3)),
    )  # fmt: skip
    words = " ".join(Reader(make_page(nothing, Limits())).words)
    assert "no part of the working volume is seen by both cameras" in words
    assert "predicted error at the working volume unknown" in words


@pytest.mark.release
def test_it_is_written_whole(found, text, tmp_path) -> None:
    write_report(tmp_path / "r.html", found, Limits())
    assert (tmp_path / "r.html").read_text(encoding="utf-8") == text
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]

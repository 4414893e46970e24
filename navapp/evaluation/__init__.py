"""Judging results with the truth, after the run."""

from navapp.evaluation.truth import compute_mean_tre_mm

__all__ = ["compute_mean_tre_mm"]

"""Compares results with the truth, after a run."""

from navapp.evaluation.truth import compute_mean_tre_mm

__all__ = ["compute_mean_tre_mm"]

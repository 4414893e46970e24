"""Judging results with the truth, after the run."""

from navapp.evaluation.truth import mean_tre_mm

__all__ = ["mean_tre_mm"]

"""The display in the mirror, calibrated by an eye that aligns crosses with a board's corners."""

"""Other people's trackers on the frames of the paper's tables."""

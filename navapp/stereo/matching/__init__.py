"""Which pixels of the two pictures belong together, to a whole disparity and some."""

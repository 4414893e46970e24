"""Searches for a bone: near an expected pose, buried in tissue, after a loss, in the whole view."""

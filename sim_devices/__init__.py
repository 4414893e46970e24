"""A simulated operating room: knee, lamps, cameras and display, with the truth kept apart."""

import navapp  # noqa: F401 (sets the environment before any heavy import)

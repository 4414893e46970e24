"""A code shown on the display and watched by the camera: how late it is seen."""

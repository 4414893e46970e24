"""Views of a camera at the eye's place, or crosses that an eye aligned, to a display model."""

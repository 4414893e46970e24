"""How late the display is seen: a code shown on it and recorded with the camera."""

"""How late a display is seen, and which eye sees it later, from a code of light and darkness."""

"""Delay of a display, per eye, from pictures of a display that flashes a known random code."""

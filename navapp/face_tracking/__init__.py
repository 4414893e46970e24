"""Follows a bone of which hardly more than a sawn face is seen: a patella after its cut."""

from navapp.face_tracking.face_tracker import FaceTracker

__all__ = ["FaceTracker"]

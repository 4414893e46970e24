"""Simulated firmware of a projector and a mirror mount, for the real drivers to talk to.

The state machines run on an injected clock and are written from the makers' documents, apart from
the drivers: an error in one is seen by the other.
"""

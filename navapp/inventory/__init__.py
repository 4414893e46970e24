"""What is connected, how the configuration chooses it, and what is missing. Nothing is started.

It needs neither numpy nor numba: `navapp doctor` works where they do not.
"""

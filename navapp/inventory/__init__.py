"""Lists connected devices, how each is chosen and what is missing, without starting any.

It needs neither numpy nor numba: `navapp doctor` works where they do not.
"""

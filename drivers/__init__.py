"""Devices: small interfaces, contract checks, and one module for each real device."""

import navapp  # noqa: F401 (sets the environment before any heavy import)

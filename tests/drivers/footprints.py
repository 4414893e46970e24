"""What a process holds, before and after many unplugs."""

import gc
import os
import threading
from pathlib import Path

import psutil
import pytest

from tests.many import few_of

# How often something is unplugged; the second half of it must leave nothing.
CYCLES = few_of([100, 1000])
_MOST_GROWTH_MB = 8.0

Footprint = tuple[int, int, int, float]

needs_descriptors = pytest.mark.skipif(
    not Path("/proc/self/fd").is_dir(), reason="descriptors are not told here"
)


def footprint() -> Footprint:
    """Threads, descriptors, objects, resident MB."""
    gc.collect()
    n_open = len(os.listdir("/proc/self/fd"))
    resident_mb = psutil.Process().memory_info().rss / 2**20
    return threading.active_count(), n_open, len(gc.get_objects()), resident_mb


def assert_nothing_is_left(settled: Footprint, n_cycles: int) -> None:
    """Since half of the cycles."""
    threads, n_open, n_objects, resident_mb = footprint()
    assert threads <= settled[0]
    assert n_open <= settled[1]
    assert n_objects < settled[2] + n_cycles // 4  # half an object a cycle would be a leak
    assert resident_mb < settled[3] + _MOST_GROWTH_MB

"""OpenCV's V4L2 code and our listing, with a preloaded library in the place of the kernel."""

import re

import pytest

from tests.drivers.preloading import python, v4l2

pytestmark = pytest.mark.waits

TESTS = ("tests/drivers/preloaded_v4l2.py", "tests/drivers/discovery/preloaded_v4l_cameras.py")
N_LEAST = 35


@pytest.mark.release
@pytest.mark.slow
def test_drivers_and_listing_work_above_the_kernels_own_questions(tmp_path):
    library, root = v4l2(tmp_path)
    done = python(library, "-m", "pytest", "-q", "-p", "no:cacheprovider", *TESTS, **root)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed is not None
    assert int(passed[1]) >= N_LEAST

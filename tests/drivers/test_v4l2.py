"""OpenCV's unmodified V4L2 code, with a preloaded library in the place of the kernel."""

import re

import pytest

from tests.drivers.preloading import compiled, python

PAGE_BYTES = 4096


@pytest.mark.slow
def test_the_driver_works_above_opencvs_own_v4l2_code(tmp_path):
    library = compiled("v4l2_fake.c", tmp_path)
    (tmp_path / "dev").mkdir()
    (tmp_path / "page").write_bytes(bytes(PAGE_BYTES))
    root = {"V4L2_FAKE_ROOT": str(tmp_path)}
    opening = "import os; os.open(os.environ['V4L2_FAKE_ROOT'] + '/dev/video0', os.O_RDWR)"
    (tmp_path / "dev" / "video0").touch()
    if "No such device" not in python(library, "-c", opening, **root).stderr:
        pytest.skip("a preloaded library does not answer for the kernel here")
    tests = "tests/drivers/preloaded_v4l2.py"
    done = python(library, "-m", "pytest", "-q", "-p", "no:cacheprovider", tests, **root)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed is not None
    assert int(passed[1]) >= 30

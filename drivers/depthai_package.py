"""The DepthAI package, imported at first use.

`navapp.environment` has switched its telemetry, uploads and network search off by then.
"""

from typing import Any

from navapp.errors import DeviceNotFound


def import_depthai() -> Any:
    """The module.

    Raises:
        DeviceNotFound: it is not installed, or does not load.
    """
    try:
        import depthai as module
    except ImportError as error:
        raise DeviceNotFound(
            f"OAK cameras need the package depthai ({error})",
            subject="depthai",
            remedy="pip install 'navapp[oak]'; if it is there, make system-deps",
        ) from error
    return module

"""What a child process of ours needs."""

import os
from pathlib import Path


def child_environment() -> dict[str, str]:
    """This process's environment, in which Python finds these packages from any folder."""
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}

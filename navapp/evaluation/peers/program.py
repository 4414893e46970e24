"""Starts the program that runs other people's trackers, in an environment of their own."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import navapp
from drivers.child_python import find_last_words, make_child_environment
from navapp.errors import NavappError, UsageError

_ROOT = Path(navapp.__file__).resolve().parents[1]
_PROGRAM = "tests.bench.peer_frames"
_PYTHON = Path(".venv-peers", "bin", "python")


def check_peers(root: Path = _ROOT) -> None:
    """Refuse --peers where the peers cannot be run, before anything else is.

    Raises:
        UsageError: the program, its environment, or a library in that is missing.
    """
    if not (root / f"{_PROGRAM.replace('.', '/')}.py").is_file():
        raise UsageError(
            "the peers belong to navapp's repository, and this installation has no tests",
            remedy="run `make setup peers` in a clone of the repository, and its navapp",
        )
    if not (root / _PYTHON).is_file():
        raise UsageError("the peers' environment is missing", remedy=f"run `make peers` in {root}")
    done = subprocess.run(
        _command(root, "--check"), stdin=subprocess.DEVNULL, capture_output=True, text=True,
        check=False, env=make_child_environment(),
    )  # fmt: skip
    if done.returncode != 0:
        raise UsageError(
            f"the peers' environment is not complete ({find_last_words(done)})",
            remedy=f"run `make peers` in {root}",
        )


def run_program(folder: Path, on_done: Callable[[str], None], root: Path = _ROOT) -> None:
    """Let the peers follow every test of an evaluation that they have not followed yet.

    Args:
        folder: of the evaluation.
        on_done: told the name of each test that is done, also of those that were before.
        root: of the repository.

    Raises:
        NavappError: the program failed; what is done is kept.
    """
    # Its errors go to our stderr. If this process is killed, it ends when it tells its next test.
    with subprocess.Popen(
        _command(root, str(folder.resolve())), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        text=True, env=make_child_environment(),
    ) as process:  # fmt: skip
        try:
            for line in process.stdout or ():
                on_done(line.strip())
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        raise NavappError(
            f"the peers' program ended with code {process.returncode}; what is done is kept",
            remedy="run again, or leave out --peers",
        )


def _command(root: Path, argument: str) -> list[str]:
    # -P: a folder of the user's that is named `tests` must not be taken for ours.
    return [str(root / _PYTHON), "-P", "-m", _PROGRAM, argument]

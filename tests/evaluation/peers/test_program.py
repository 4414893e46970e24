"""Where the peers' program is looked for, what is refused, and how it ends."""

import os
from pathlib import Path

import pytest

from navapp.errors import NavappError, UsageError
from navapp.evaluation.peers.program import check_peers, run_program


@pytest.fixture
def repository(tmp_path: Path):
    """A repository whose peers' Python is a shell script."""
    program = tmp_path / "tests/bench/peer_frames.py"
    program.parent.mkdir(parents=True)
    program.touch()

    def make(script: str) -> Path:
        python = tmp_path / ".venv-peers/bin/python"
        python.parent.mkdir(parents=True)
        python.write_text(f"#!/bin/sh\n{script}\n")
        os.chmod(python, 0o755)
        return tmp_path

    make.root = tmp_path
    return make


def test_without_the_repository_the_command_is_named(tmp_path) -> None:
    with pytest.raises(UsageError, match="no tests: run `make setup peers` in a clone"):
        check_peers(tmp_path)


def test_without_the_environment_the_command_is_named(repository) -> None:
    with pytest.raises(UsageError, match="environment is missing: run `make peers` in"):
        check_peers(repository.root)


def test_half_an_environment_is_told_before_anything_is_run(repository) -> None:
    root = repository("echo 'No module named open3d' >&2; exit 1")
    with pytest.raises(
        UsageError, match=r"not complete \(No module named open3d\): run `make peers`"
    ):
        check_peers(root)


def test_it_is_asked_for_its_own_module_and_the_folder(repository, tmp_path) -> None:
    root = repository('echo "$@"')
    check_peers(root)
    told = []
    run_program(tmp_path / "out", told.append, root)
    assert told == [f"-P -m tests.bench.peer_frames {tmp_path / 'out'}"]


def test_each_test_is_told_and_a_failure_is_an_error(repository, tmp_path) -> None:
    told = []
    with pytest.raises(NavappError, match="ended with code 7; what is done is kept: run again"):
        run_program(tmp_path, told.append, repository("echo one; echo two; exit 7"))
    assert told == ["one", "two"]


def test_stopped_it_does_not_go_on(repository, tmp_path) -> None:
    def stop(_: str) -> None:
        raise KeyboardInterrupt

    root = repository(f"echo one; exec 1>&-; sleep 60; touch {tmp_path}/late")
    with pytest.raises(KeyboardInterrupt):
        run_program(tmp_path, stop, root)
    assert not (tmp_path / "late").exists()

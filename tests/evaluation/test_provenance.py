"""What a result says of the code and the machine that made it."""

import subprocess
from pathlib import Path

import numpy as np

from navapp import __version__
from navapp.environment import source_hash
from navapp.evaluation.provenance import describe_origin, find_commit


def git(folder: Path, *words: str) -> str:
    named = ("-c", "user.name=a", "-c", "user.email=a@b")
    told = subprocess.run(
        ["git", "-C", str(folder), *named, *words], capture_output=True, text=True, check=True
    )
    return told.stdout.strip()


def test_a_checkout_has_a_commit_and_a_changed_one_says_so(tmp_path) -> None:
    git(tmp_path, "init", "--quiet")
    (tmp_path / "a.py").write_text("x = 1\n")
    git(tmp_path, "add", "a.py")
    git(tmp_path, "commit", "--quiet", "-m", "first")
    commit = git(tmp_path, "rev-parse", "--short=8", "HEAD")
    assert find_commit(tmp_path) == commit
    (tmp_path / "a.py").write_text("x = 2\n")
    assert find_commit(tmp_path) == f"{commit}-dirty"


def test_what_is_no_checkout_has_none(tmp_path, monkeypatch) -> None:
    assert find_commit(tmp_path) is None
    (tmp_path / ".git").write_text("damaged")
    assert find_commit(tmp_path) is None
    monkeypatch.setenv("PATH", "")
    assert find_commit(tmp_path) is None


def test_the_line_names_code_libraries_and_machine() -> None:
    line = describe_origin()
    # The line is kept as it was first asked for: another process may have changed a file since.
    commit = (find_commit(Path(__file__).resolve().parents[2]) or "").removesuffix("-dirty")
    for part in (__version__, commit, source_hash(), f"numpy {np.__version__}", " cores"):
        assert part in line

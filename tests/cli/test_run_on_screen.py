"""What `navapp run` says once the screen is gone."""

import argparse
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from navapp.cli import run
from navapp.cli.diagnostics import Diagnostics
from tests.ui import plans


class FailedRunner:
    """Stands for a pipeline that ended by an error."""

    def __init__(self, _controller: Any) -> None:
        self.error: Exception | None = None

    def start(self) -> None:
        self.error = RuntimeError("the pipeline failed")

    def stop(self) -> None:
        pass


def test_where_the_recording_is_is_told_after_a_failure_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    controller = SimpleNamespace(snapshot=SimpleNamespace(is_recording=True))
    monkeypatch.setattr("navapp.control.runner.SessionRunner", FailedRunner)
    monkeypatch.setattr("navapp.ui.run_screen.run_screen", lambda *_, **__: 5)
    monkeypatch.setattr(run, "make_controller", lambda *_, **__: controller)
    monkeypatch.setattr(run, "log_folder", lambda: tmp_path)
    recording = tmp_path / "session"
    recording.mkdir()
    session: Any = SimpleNamespace(
        configuration=SimpleNamespace(
            plan=SimpleNamespace(path=None),
            recording=SimpleNamespace(folder=str(recording)),
            ui=SimpleNamespace(pictures="blocks"),
        ),
        specification=SimpleNamespace(plan=plans.make_plan()),
        opened=SimpleNamespace(devices=SimpleNamespace(close=lambda: None)),
    )
    monkeypatch.setattr(run, "_hints", lambda *_: [])
    monkeypatch.setattr(run, "_background", lambda *_: None)
    options = argparse.Namespace(frames=None, guide=None)
    with pytest.raises(RuntimeError, match="the pipeline failed"):
        run._run_screen(session, options, Diagnostics())
    assert f"recorded session: {recording}" in capsys.readouterr().out

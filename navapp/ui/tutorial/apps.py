"""The live screens with the tutorial's lines above their pictures."""

from typing import Any

from navapp.control.capture.states import CaptureSnapshot
from navapp.control.states import Snapshot
from navapp.ui.app import NavigationApp
from navapp.ui.capture.app import CaptureApp, CaptureSession
from navapp.ui.session import Session
from navapp.ui.symbols import Symbols
from navapp.ui.tutorial.guide import Guide
from navapp.ui.tutorial.lines import TutorialCaptureLines, TutorialLines

_CSS = "#tutorial { height: 3; background: $panel; }"


class TutorialApp(NavigationApp):
    """The operator's screen with a guide through it."""

    CSS = _CSS

    def __init__(self, guide: Guide[Snapshot], session: Session, title: str, **how: Any) -> None:
        super().__init__(session, title, **how)
        self._guide = guide

    def on_mount(self) -> None:
        """Put the lines above the picture, once that is there."""
        self.call_after_refresh(self._add_lines)

    def _add_lines(self) -> None:
        body = self.screen_stack[0].query_one("#body")
        body.mount(TutorialLines(self._guide), before="#middle")

    def poll(self) -> None:
        """Tick what is reached, then show it."""
        self._guide.observe(self._session.snapshot())
        super().poll()


class TutorialCaptureApp(CaptureApp):
    """The screen of a guided capture with a guide through it."""

    CSS = _CSS

    def __init__(
        self, guide: Guide[CaptureSnapshot], session: CaptureSession, *, symbols: Symbols
    ) -> None:
        super().__init__(session, symbols=symbols)
        self._guide = guide

    def on_mount(self) -> None:
        """Put the lines above the pictures, once those are there."""
        self.call_after_refresh(self._add_lines)

    def _add_lines(self) -> None:
        body = self.screen_stack[0].query_one("#body")
        body.mount(TutorialCaptureLines(self._guide), before="#pictures")

    def poll(self) -> None:
        """Tick what is reached, then show it."""
        self._guide.observe(self._session.snapshot())
        super().poll()

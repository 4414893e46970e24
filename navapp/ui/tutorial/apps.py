"""The live screens with the tutorial's lines above their pictures."""

from typing import Any

from textual.screen import Screen

from navapp.control.capture.states import CaptureSnapshot
from navapp.control.states import Snapshot
from navapp.ui.app import NavigationApp
from navapp.ui.capture.app import CaptureApp, CaptureScreen, CaptureSession
from navapp.ui.main_screen import MainScreen
from navapp.ui.session import Session
from navapp.ui.symbols import Symbols
from navapp.ui.tutorial.guide import Guide
from navapp.ui.tutorial.lines import TutorialCaptureLines, TutorialLines
from navapp.ui.view import View

_CSS = "#tutorial { height: 3; background: $panel; }"


class TutorialScreen(MainScreen):
    """The main screen with the guide's lines."""

    def __init__(self, guide: Guide[Snapshot], view: View) -> None:
        super().__init__(view)
        self._guide = guide

    def on_mount(self) -> None:
        """Put the lines above the picture."""
        self.query_one("#body").mount(TutorialLines(self._guide), before="#middle")


class TutorialApp(NavigationApp):
    """The operator's screen with a guide through it."""

    CSS = _CSS

    def __init__(self, guide: Guide[Snapshot], session: Session, title: str, **how: Any) -> None:
        super().__init__(session, title, **how)
        self._guide = guide

    def get_default_screen(self) -> Screen[None]:
        """The main screen."""
        return TutorialScreen(self._guide, self._view)

    def poll(self) -> None:
        """Tick what is reached, then show it."""
        self._guide.observe(self._session.snapshot())
        super().poll()


class TutorialCaptureScreen(CaptureScreen):
    """The screen of a capture with the guide's lines."""

    def __init__(self, guide: Guide[CaptureSnapshot]) -> None:
        super().__init__()
        self._guide = guide

    def on_mount(self) -> None:
        """Put the lines above the pictures."""
        self.query_one("#body").mount(TutorialCaptureLines(self._guide), before="#pictures")


class TutorialCaptureApp(CaptureApp):
    """The screen of a guided capture with a guide through it."""

    CSS = _CSS

    def __init__(
        self,
        guide: Guide[CaptureSnapshot],
        session: CaptureSession,
        *,
        symbols: Symbols,
        **how: Any,
    ) -> None:
        super().__init__(session, symbols=symbols, **how)
        self._guide = guide
        self._guided_screen = TutorialCaptureScreen(guide)

    def poll(self) -> None:
        """Tick what is reached, then show it."""
        self._guide.observe(self._session.snapshot())
        super().poll()

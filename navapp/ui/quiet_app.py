"""An application that ends with a one-sentence error instead of a traceback."""

import asyncio
import signal
import sys
from pathlib import Path
from typing import ClassVar

from textual import events
from textual.app import App

from navapp.errors import NavappError
from navapp.ui.pictures.graphics import Graphics, measure_cell
from navapp.ui.pictures.painter import Painter
from navapp.ui.pictures.picture import Picture
from navapp.ui.terminal import is_terminal_lost

_S_PER_LOOK = 0.5


class QuietApp(App[int]):
    """An application that stores a fatal error instead of drawing its traceback.

    Attributes:
        failure: what ended it, or None.
        painter: of pictures; None: they are half blocks.
    """

    # Where it does nothing, the terminal keeps it for selecting text.
    uses_mouse: ClassVar[bool] = False
    failure: Exception | None = None
    painter: Painter | None = None

    def use_graphics(self, graphics: Graphics) -> None:
        """Have the terminal paint pictures, where it can; before the application runs."""
        if graphics.encoder is not None:
            self.painter = Painter(graphics, self._write_to_terminal)

    def stop_painting(self) -> None:
        """Half blocks of the screen's library from now on: the terminal cannot be reached so."""
        painter = self.painter
        if painter is None:
            return
        for screen in self.screen_stack:
            for picture in screen.query(Picture):
                picture.leave_place()
        self.painter = None
        painter.close()

    def on_resize(self, _event: events.Resize) -> None:
        """Characters may have another size as well."""
        if self.painter is not None and self.painter.has_pixels and sys.__stdout__ is not None:
            self.painter.cell_px = measure_cell(sys.__stdout__.fileno()) or self.painter.cell_px

    def _write_to_terminal(self, text: str) -> None:
        """Behind what the screen has written so far; Textual has no public way to do so."""
        if self._driver is not None:
            self._driver.write(text)

    def _handle_exception(self, error: Exception) -> None:
        """Keep what ends the application, for the sentence afterwards."""
        self.failure = self.failure or error
        super()._handle_exception(error)

    def _fatal_error(self) -> None:
        """End without a traceback on the screen."""
        self._close_messages_no_wait()

    def panic(self, *_renderables: object) -> None:
        """As `_fatal_error`, for errors that would draw themselves."""
        self._close_messages_no_wait()


async def drive(app: QuietApp) -> int:
    """Run it to its end; the exit code, 128 and the number of the signal that ended it.

    A lost terminal ends it as SIGHUP does, which not every terminal sends.
    """
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        loop.add_signal_handler(number, app.exit, 128 + number)
    watch = asyncio.create_task(_end_without_terminal(app))
    try:
        result = await app.run_async(mouse=app.uses_mouse)
    finally:
        watch.cancel()
        if app.painter is not None:
            app.painter.close()
    return 1 if result is None else result


async def _end_without_terminal(app: QuietApp) -> None:
    while not is_terminal_lost():
        await asyncio.sleep(_S_PER_LOOK)
    app.exit(128 + signal.SIGHUP)


def say(failure: Exception, log_path: Path) -> int:
    """One sentence on the standard error; the exit code."""
    if isinstance(failure, NavappError):
        text, code = str(failure), failure.exit_code
    else:
        text = f"the screen failed ({type(failure).__name__}: {failure}): see {log_path}"
        code = 1
    sys.stderr.write(f"navapp: error: {' '.join(text.split())}\n")
    return code

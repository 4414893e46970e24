"""Shows pictures on the display, blanks it, and opens it again when it is lost."""

import threading

from drivers.interfaces import Display
from navapp.control.backoff import Backoff
from navapp.control.pictures import Image
from navapp.errors import DeviceError, DeviceLost
from navapp.overlay.fitting import put_on_canvas

_PAUSES_S = (0.5, 8.0)


class DisplayLink:
    """Shows pictures unless the operator has blanked the display; one that is lost is opened again.

    Attributes:
        is_blanked: by the operator; nothing is shown until `show_again`.
        trouble: what is wrong with the display, empty when nothing is.
    """

    def __init__(self, display: Display) -> None:
        self._display = display
        self._has_guides = False
        self._reopener = _Reopener(display)
        self.is_blanked = False
        self.trouble = ""

    @property
    def display(self) -> Display:
        """The device."""
        return self._display

    def blank(self) -> None:
        """Dark until `show_again`; callable from any thread."""
        self.is_blanked = True
        self._display.blank()

    def show_again(self) -> None:
        """Pictures may be shown from the next frame on."""
        self.is_blanked = False

    def darken(self) -> None:
        """Dark until the next picture."""
        self._display.blank()
        self._has_guides = False

    def show(
        self, image: Image, valid_until_ns: int, *, has_guides: bool, is_scaled: bool = True
    ) -> bool:
        """Show a picture; whether there is a new trouble to tell.

        It is fitted to the display, unless one pixel of it must be one of the display
        (`is_scaled`).
        """
        if self.is_blanked or self._reopener.is_under_way:
            return False
        is_new = False
        self._has_guides = has_guides
        try:
            info = self._display.info
            fitted = put_on_canvas(image, info.width, info.height) if is_scaled else image
            self._display.show(fitted, valid_until_ns)
            self.trouble = ""
            self._reopener.note_success()
        except DeviceError as error:
            failure = self._reopener.failure
            is_new = not self.trouble or failure not in ("", self.trouble)
            self.trouble = failure or str(error)
            if isinstance(error, DeviceLost):
                self._reopener.begin()
        self._keep_dark()
        return is_new

    def _keep_dark(self) -> None:
        """The operator may have blanked the display while a picture was on its way."""
        if self.is_blanked:
            self._display.blank()

    def withdraw_guides(self) -> bool:
        """Turn a picture dark whose guides have become wrong; whether there was one."""
        had_guides = self._has_guides
        if had_guides:
            self.darken()
        return had_guides

    def close(self) -> None:
        """Dark, and not opened any more."""
        self.darken()
        self._reopener.close()


class _Reopener:
    """Opens a lost display in a thread, which no frame waits for, with growing pauses.

    Attributes:
        failure: what the last attempt failed with that no display should; empty for nothing.
    """

    def __init__(self, display: Display) -> None:
        self._display = display
        self._thread: threading.Thread | None = None
        self.failure = ""
        self._backoff = Backoff(*_PAUSES_S)
        self._is_over = threading.Event()

    @property
    def is_under_way(self) -> bool:
        """Nothing else may be asked of the display, but to be blank."""
        return self._thread is not None and self._thread.is_alive()

    def begin(self) -> None:
        """One attempt, after the pause."""
        if not self._is_over.is_set():
            self._thread = threading.Thread(target=self._run, name="display", daemon=True)
            self._thread.start()

    def note_success(self) -> None:
        """A picture was shown: the next loss is a new one."""
        self._backoff.reset()

    def close(self) -> None:
        """Wait for the attempt that is under way."""
        self._is_over.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        if self._is_over.wait(self._backoff.next_pause_s()):
            return
        self.failure = ""
        try:
            self._display.open()
        except DeviceError:
            # The next picture finds it lost and says why.
            return
        except Exception as error:  # noqa: BLE001 (a bug must be told, not end as a silent thread)
            self.failure = f"opening the display failed: {error!r}"

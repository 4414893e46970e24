"""The controller's line to its display: blank, withdrawn guides, trouble."""

from drivers.interfaces import Display
from navapp.control.pictures import Image, fitted
from navapp.errors import DeviceError


class DisplayLink:
    """Shows pictures unless the operator has blanked the display.

    Attributes:
        is_blanked: by the operator; nothing is shown until `show_again`.
        trouble: what is wrong with the display, empty when nothing is.
    """

    def __init__(self, display: Display) -> None:
        self._display = display
        self._has_guides = False
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

    def show(self, image: Image, valid_until_ns: int, *, has_guides: bool) -> bool:
        """Show a picture, fitted to the display; whether the display has just begun to fail."""
        if self.is_blanked:
            return False
        has_begun_to_fail = False
        self._has_guides = has_guides
        try:
            info = self._display.info
            self._display.show(fitted(image, info.width, info.height), valid_until_ns)
            self.trouble = ""
        except DeviceError as error:
            has_begun_to_fail = not self.trouble
            self.trouble = str(error)
        self._keep_dark()
        return has_begun_to_fail

    def _keep_dark(self) -> None:
        """The operator may have blanked the display while a picture was on its way."""
        if self.is_blanked:
            self._display.blank()

    def withdraw_guides(self) -> None:
        """Turn a picture dark whose guides a command or the passing time has made wrong."""
        if self._has_guides:
            self.darken()

"""The page of the settings in force: first those that differ from the defaults."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.widgets import Static

from navapp.config import Configuration, format_toml
from navapp.ui.background import Background
from navapp.ui.screens import PageScreen
from navapp.ui.view import View

Setting = tuple[str, str]  # table, and the key with its value as TOML


def list_settings(configuration: Configuration) -> list[Setting]:
    """Every key of the configuration with its table, in the order of the file."""
    settings, table = list[Setting](), ""
    for line in format_toml(configuration, with_comments=False).splitlines()[1:]:
        if line.startswith("["):
            table = line.strip("[]")
        elif line:
            settings.append((table, line))
    return settings


def find_changed(configuration: Configuration) -> list[Setting]:
    """Those that are not the defaults."""
    defaults = set(list_settings(Configuration()))
    return [one for one in list_settings(configuration) if one not in defaults]


def format_settings(background: Background) -> list[Content]:
    """What was changed, then everything, table by table."""
    configuration = background.configuration
    changed = find_changed(configuration)
    source = background.source or "no file: defaults, and the command line"
    lines = [Content.assemble((" from  ", "$text-muted"), source), Content("")]
    lines.append(Content.styled(" other than the defaults", "$text-muted"))
    lines += _tables(changed, set(changed)) or [Content("   nothing")]
    lines += [Content(""), Content.styled(" all, changed ones bold", "$text-muted")]
    lines += _tables(list_settings(configuration), set(changed))
    note = " `navapp config init` writes a file that says what each of them means"
    return [*lines, Content(""), Content.styled(note, "$text-muted")]


def _tables(settings: list[Setting], changed: set[Setting]) -> list[Content]:
    lines, last = list[Content](), ""
    for one in settings:
        table, text = one
        if table != last:
            lines.append(Content.styled(f"   [{table}]", "$primary"))
        style = "bold $foreground" if one in changed else "$foreground"
        lines.append(Content.styled(f"     {text}", style))
        last = table
    return lines


class SettingsPage(PageScreen):
    """Settings in force, scrollable."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("s", "dismiss", "back", show=False)]

    page_title, keys = "settings in force", " back  arrows, PgUp, PgDn scroll"
    container = VerticalScroll

    def __init__(self, view: View, background: Background) -> None:
        super().__init__(view)
        self._background = background

    def compose_page(self) -> ComposeResult:
        """Settings; they do not change while the session runs."""
        yield Static(Content("\n").join(format_settings(self._background)), id="settings")

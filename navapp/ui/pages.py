"""Pages over the main screen: devices, events, and the question before quitting."""

import dataclasses
import textwrap
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Static

from navapp.ui.actions import ACTION_OF_NAME
from navapp.ui.devices_panel import format_device_line
from navapp.ui.event_list import format_event_line
from navapp.ui.screens import PageScreen, ViewScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import View


class DeviceDetails(TextView):
    """Every device with its name and what it says."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line a device, what it says below."""
        lines = []
        for device in view.snapshot.devices:
            lines.append(format_device_line(view, dataclasses.replace(device, detail=""), width))
            said = textwrap.wrap(device.detail, max(width - 2, 1)) or [""]
            lines += [Content(f"  {line}") for line in said]
        return lines or [Content("no devices")]


class DevicesPage(PageScreen):
    """Devices in detail; lost ones can be opened again from here."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("d", "dismiss", "back", show=False),
        ACTION_OF_NAME["reconnect"].binding(),
    ]

    page_title, keys = "devices", " back  o reopen lost devices"

    def compose_page(self) -> ComposeResult:
        """Devices."""
        yield DeviceDetails("details")


class EventsPage(PageScreen):
    """All events that the snapshot holds, scrollable, newest first."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("e", "dismiss", "back", show=False)]

    page_title, keys = "events", " back  arrows, PgUp, PgDn scroll"
    container = VerticalScroll

    def compose_page(self) -> ComposeResult:
        """Events."""
        yield Static(id="all-events")

    def show(self, view: View, *, is_text_due: bool) -> None:
        """Take over new events when there are any."""
        is_new = view.snapshot.events != self.view.snapshot.events
        super().show(view, is_text_due=is_text_due)
        events = self.query_one("#all-events", Static)
        if is_new or not events.content:
            width = max(self.size.width - 4, 20)
            lines = [format_event_line(view, event, width) for event in view.snapshot.events[::-1]]
            events.update(Content("\n").join(lines or [Content(" nothing happened yet")]))


class QuestionText(TextView):
    """What quitting means, and the two answers."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Words first, keys below."""
        return [
            Content.styled("End the session?", "bold $foreground"),
            Content("The display goes dark, the registration is lost."),
            Content(""),
            Content.assemble(
                ("y", "bold $primary"), " end   ", ("n", "bold $primary"), " stay   ",
                ("SPACE", "bold $primary"), " blank only",
            ),
        ]  # fmt: skip


class QuitQuestion(ViewScreen[bool], ModalScreen[bool]):
    """Asked once while navigating; only `y` ends the session."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y", "dismiss(True)", "end", show=False),
        Binding("n,escape", "dismiss(False)", "stay", show=False),
    ]

    def compose(self) -> ComposeResult:
        """A box over the picture, which goes on."""
        yield QuestionText("question")

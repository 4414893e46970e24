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
    """Every device with its name, what it says, and what to do where it is in trouble."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line a device, the rest below."""
        lines = []
        for device in view.snapshot.devices:
            lines.append(format_device_line(view, dataclasses.replace(device, detail=""), width))
            said = textwrap.wrap(device.detail, max(width - 2, 1)) or [""]
            lines += [Content(f"  {line}") for line in said]
            remedy = textwrap.wrap(device.remedy, max(width - 5, 1))
            marks = ["->", *["  "] * len(remedy)]
            lines += [
                Content.styled(f"  {mark} {line}", "bold $foreground")
                for mark, line in zip(marks, remedy, strict=False)
            ]
        return lines or [Content("no devices")]


class DevicesPage(PageScreen):
    """Devices in detail; lost ones can be opened again from here."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("d", "dismiss", "back", show=False),
        ACTION_OF_NAME["reconnect"].binding(),
        Binding("p", "app.set_projector('on')", "projector on", show=False),
        Binding("P", "app.set_projector('off')", "projector off", show=False),
        Binding("s", "app.set_projector('source')", "projector's source", show=False),
        Binding("f", "app.set_projector('flips')", "projector's flips", show=False),
    ]

    page_title = "devices"
    keys = " back  o reopen lost  projector: p on  P off  s source  f flips"

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
    """What a question is about, and the answers to it."""

    def __init__(self, question: str, meaning: str, yes: str, no: str) -> None:
        super().__init__("question")
        self._words = question, meaning, yes, no

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Words first, keys below."""
        question, meaning, yes, no = self._words
        return [
            Content.styled(question, "bold $foreground"),
            Content(meaning),
            Content(""),
            Content.assemble(
                ("y", "bold $primary"), f" {yes}   ", ("n", "bold $primary"), f" {no}   ",
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
        yield QuestionText(
            "End the session?", "The display goes dark, the registration is lost.", "end", "stay"
        )


class PowerQuestion(ViewScreen[bool], ModalScreen[bool]):
    """Asked before the projector is switched off; only `y` does it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y", "dismiss(True)", "switch off", show=False),
        Binding("n,escape,q", "dismiss(False)", "leave it", show=False),
    ]

    def compose(self) -> ComposeResult:
        """A box over the devices."""
        yield QuestionText(
            "Switch the projector off?",
            "It shows nothing until its lamp is warm again.",
            "switch off",
            "leave it",
        )

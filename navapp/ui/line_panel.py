"""The line panel: frame rate, latency, dropped frames and skew."""

from textual.content import Content

from navapp.ui.gauges import Number, draw_sparkline
from navapp.ui.text_view import TextView
from navapp.ui.view import View

_MAX_COUNT = 99_999


class LinePanel(TextView):
    """Rate and latency with their recent course, drops, skew."""

    def __init__(self) -> None:
        super().__init__("line")
        self.border_title = "line"

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """Three lines; what else there is room for."""
        rates, symbols = view.snapshot.rates, view.symbols
        room = width - 10
        lines = [
            Content.assemble(
                Number.RATE.text(rates.frames_per_s),
                (" fps ", "$text-muted"),
                (draw_sparkline(rates.fps_history, room, symbols), "$secondary"),
            ),
            Content.assemble(
                Number.RATE.text(rates.latency_ms),
                (" ms  ", "$text-muted"),
                (draw_sparkline(rates.latency_history_ms, room, symbols), "$secondary"),
            ),
            Content.assemble(
                ("drops ", "$text-muted"),
                f"{min(rates.n_dropped, _MAX_COUNT):5d}",
                ("  skew", "$text-muted"),
                Number.SKEW.text(rates.skew_ms),
                (" ms", "$text-muted"),
            ),
        ]
        light = rates.light
        if light is not None and height > len(lines):
            told = f"{light.mean_ms:5.0f} +-{light.spread_ms:.0f}"
            lines.append(Content.assemble(("light", "$text-muted"), told, (" ms", "$text-muted")))
        if height > len(lines):
            lines.append(Content.assemble(("frames ", "$text-muted"), f"{rates.n_frames:d}"))
        return lines

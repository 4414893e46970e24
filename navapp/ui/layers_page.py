"""The page on which layers of the overlay are switched, and the legend of what they show."""

from dataclasses import dataclass
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content

from navapp.ui.screens import PageScreen
from navapp.ui.text_view import TextView
from navapp.ui.view import View


@dataclass(frozen=True, slots=True)
class LayerKey:
    """One layer of the overlay on the screen."""

    name: str  # as the overlay's table of layers has it
    key: str
    shows: str  # in a few words, with its colour


LAYER_KEYS: tuple[LayerKey, ...] = (
    LayerKey("bone", "b", "outline and light veil: green, a candidate amber"),
    LayerKey("removal", "x", "bone beyond the cuts: dark blue is little, yellow is much"),
    LayerKey("defects", "d", "damaged cartilage: red dots"),
    LayerKey("risks", "n", "vessels, nerves; orange: bone within their safety distance"),
    LayerKey("parts", "i", "implants and spacers where they will sit: white"),
    LayerKey("planes", "p", "cut lines on the bone, frames of the cuts: light blue"),
    LayerKey("drills", "h", "holes: entry cross and rim, axis, end: pink"),
    LayerKey("targets", "t", "planned single points: cyan crosses"),
    LayerKey("scale", "s", "how long some mm are at the bone's depth"),
)

LEGEND: tuple[tuple[str, str], ...] = (
    ("green outline", "the bone, navigable"),
    ("amber outline", "a candidate that nobody has accepted"),
    ("whole lines", "in sight, on the bone or before it"),
    ("dashed, fainter", "beneath bone or tissue, or the depth there is not known"),
    ("nothing", "behind a hand, an instrument, or what stands off by more than 5 mm"),
    ("light blue, pink", "cuts; holes with entry cross, axis and end"),
    ("white", "implants and spacers"),
    ("dark blue - yellow", "bone to be removed, from none to 15 mm and more"),
    ("red, blue, yellow", "arteries, veins, nerves; orange: bone that is too near to them"),
    ("cyan, red dots", "targets; damaged cartilage"),
)


class LayerTable(TextView):
    """All layers with their letters, and whether they are drawn now."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line a layer."""
        lines = [_format_layer(layer, layer.name in view.snapshot.layers) for layer in LAYER_KEYS]
        notes = (
            " They are drawn while guides are shown; `?` has the legend.",
            " The next stage begins with its own layers.",
        )
        return [*lines, Content(""), *(Content.styled(note, "$text-muted") for note in notes)]


def _format_layer(layer: LayerKey, is_drawn: bool) -> Content:
    style = "$foreground" if is_drawn else "$text-muted"
    return Content.assemble(
        (f" {layer.key}  ", "bold $primary"),
        (f"{'on' if is_drawn else 'off':<3}  {layer.name:<8} {layer.shows}", style),
    )


class LayersPage(PageScreen):
    """Layers, switched by their letters."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("l", "dismiss", "back", show=False),
        *(
            Binding(layer.key, f"app.toggle_layer('{layer.name}')", layer.name, show=False)
            for layer in LAYER_KEYS
        ),
    ]

    page_title, keys = "layers of the overlay", " back  a letter switches its layer"

    def compose_page(self) -> ComposeResult:
        """Layers."""
        yield LayerTable("layers")


class OverlayLegend(TextView):
    """What colours and lines of the overlay mean."""

    def build(self, view: View, width: int, height: int) -> list[Content]:
        """A line each."""
        heading = Content.styled(" the overlay", "$text-muted")
        return [
            heading,
            *(
                Content.assemble((f" {sign:<19} ", "bold $foreground"), meaning)
                for sign, meaning in LEGEND
            ),
        ]

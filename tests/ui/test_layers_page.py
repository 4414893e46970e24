"""Layers are switched on a page of their own; the help page tells what they look like."""

from collections import Counter
from typing import Any

import pytest
from textual.pilot import Pilot

from navapp.control.commands import ToggleLayer
from navapp.control.stages import STAGES
from navapp.overlay import LAYERS
from navapp.ui.actions import ACTION_OF_NAME
from navapp.ui.layers_page import LAYER_KEYS, LEGEND, LayersPage, LayerTable, OverlayLegend
from tests.ui import snapshots
from tests.ui.test_app import BellCounter, play


def test_every_layer_has_a_letter_that_neither_leaves_its_page_nor_decides_elsewhere() -> None:
    assert [layer.name for layer in LAYER_KEYS] == list(LAYERS)
    assert Counter(layer.key for layer in LAYER_KEYS).most_common(1)[0][1] == 1
    keys = {ACTION_OF_NAME[name].key for name in ("layers", "quit", "accept", "reject", "register")}
    assert not keys & {layer.key for layer in LAYER_KEYS}


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_layers_are_switched_by_their_letters(size: tuple[int, int]) -> None:
    drawn = STAGES[2].layers

    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("l", *(layer.key for layer in LAYER_KEYS))
        lines = app.text_of(LayerTable).splitlines()
        for layer, line in zip(LAYER_KEYS, lines, strict=False):
            state = "on" if layer.name in drawn else "off"
            assert line.split()[:3] == [layer.key, state, layer.name]
            assert line.rstrip().endswith(layer.shows)
            assert len(line) <= size[0] - 4
        # What the session says is shown, not what was asked for.
        app.session.current = snapshots.navigating(layers=("scale",))
        app.poll_until_text()
        await pilot.pause()
        shown = app.text_of(LayerTable).splitlines()
        assert [line.split()[1] for line in shown[: len(LAYER_KEYS)]].count("on") == 1
        assert isinstance(app.screen, LayersPage)

    app = play(snapshots.navigating(layers=drawn), script, size)
    assert app.session.commands == [ToggleLayer(layer.name) for layer in LAYER_KEYS]


def test_the_help_page_has_the_legend_of_the_overlay() -> None:
    async def script(app: BellCounter, pilot: Pilot[Any]) -> None:
        await pilot.press("question_mark")
        legend = app.screen.query_one(OverlayLegend)
        assert not app.screen.can_view_entire(legend)
        for _ in range(20):
            await pilot.press("down", "down")
            await pilot.pause()
            if app.screen.can_view_entire(legend):
                break
        assert app.screen.can_view_entire(legend)
        text = str(legend.render())
        assert all(sign in text and meaning in text for sign, meaning in LEGEND)

    play(snapshots.navigating(), script)

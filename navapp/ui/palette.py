"""The command palette's entries, from the action table."""

from functools import partial

from textual.command import DiscoveryHit, Hit, Hits, Provider

from navapp.ui.actions import ACTIONS, Action, is_possible
from navapp.ui.screens import ViewScreen


class ActionProvider(Provider):
    """Offers the actions that are possible now."""

    def _possible(self) -> list[Action]:
        screen = self.screen
        if not isinstance(screen, ViewScreen):
            return []
        view = screen.view
        return [a for a in ACTIONS if is_possible(a, view.snapshot, view.is_silent)]

    async def discover(self) -> Hits:
        """All of them."""
        for action in self._possible():
            run = partial(self.app.run_action, f"app.act('{action.name}')")
            yield DiscoveryHit(action.description, run, help=f"key {action.key_label}")

    async def search(self, query: str) -> Hits:
        """Those whose description matches."""
        matcher = self.matcher(query)
        for action in self._possible():
            score = matcher.match(action.description)
            if score > 0:
                run = partial(self.app.run_action, f"app.act('{action.name}')")
                yield Hit(score, matcher.highlight(action.description), run)

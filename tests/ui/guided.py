"""Plays on the screen of a guided calibration that shows one snapshot."""

import asyncio
from collections.abc import Callable
from typing import Any


class Session:
    """Answers with one snapshot, remembers what it was told."""

    def __init__(self, snapshot: Any) -> None:
        self.current, self.commands, self.is_over = snapshot, [], False

    def snapshot(self) -> Any:
        return self.current

    def submit(self, command: Any) -> None:
        self.commands.append(command)


def play_on(
    make_app: type, snapshot: Any, *keys: str, size: tuple[int, int], symbols: Any,
    then: Callable[[Any, Session], None] | None,
) -> tuple[Session, Any, str]:  # fmt: skip
    """Press keys; what the session was told, the application, and the text on its screen.

    The application counts its bells in `n_bells`.
    """

    class Counting(make_app):
        n_bells = 0

        def bell(self) -> None:
            self.n_bells += 1

    session = Session(snapshot)
    app = Counting(session, symbols=symbols, polls_per_s=0)
    told: list[str] = []

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            await pilot.press(*keys)
            app.poll()
            if then is not None:
                then(app, session)
            await pilot.pause()
            width, height = size
            told.extend(strip.text for strip in app.screen._compositor.render_strips())
            assert len(told) == height
            assert all(len(line) == width for line in told)

    asyncio.run(run())
    return session, app, "\n".join(told)

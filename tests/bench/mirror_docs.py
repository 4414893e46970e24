"""Makes the pictures of docs/mirror.md: the implant stage of `navapp run --mirror`.

usage: python -m tests.bench.mirror_docs [FOLDER]

Writes mirror_view.jpg (what the simulated eye sees after the check of the mirror, with the layers
that a session lights) and mirror_display.jpg (all layers of the stage, as the eye reads
the display); the folder is docs/images when none is given.
"""

import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.live_session import make_controller, prepare_session
from navapp.cli.main import _parser
from navapp.cli.practice_mirror import add_practice_mirror
from navapp.config import parse
from navapp.control.commands import (
    Accept,
    CheckMirror,
    Command,
    ConfirmCross,
    EnterStage,
    Register,
)
from navapp.control.controller import SessionController
from navapp.devices import OpenedDevices
from sim_devices.mirror_setups import make_practice_setup
from sim_devices.simulated_eye import SimulatedEye

_IMPLANT, _N_CROSSES = 3, 3
_WIDTH, _HEIGHT, _N_SAMPLES = 1280, 800, 4
_QUALITY = 92


def main() -> int:
    """Run the session and write both pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/images")
    with practice() as (opened, controller):
        light_guides(controller)
        give(controller, EnterStage(_IMPLANT))
        if not controller.snapshot.is_navigable:
            raise RuntimeError(f"no guides: {controller.snapshot.reasons}")
        write(folder / "mirror_view.jpg", see(opened, opened.devices.display.visible_image()))
        write(folder / "mirror_display.jpg", draw_all(controller))
    return 0


@contextmanager
def practice(
    simulated: Mapping[str, object] | None = None,
) -> Iterator[tuple[OpenedDevices, SessionController]]:
    """A session with the built-in simulated mirror that waits to be stepped.

    Args:
        simulated: of the simulated camera's table in the configuration.
    """
    options = _parser().parse_args(["run", "--headless", "--mirror"])
    with ExitStack() as undo:
        configuration = parse({"camera": {"simulated": dict(simulated or {})}}, "practice")
        configuration = add_practice_mirror(configuration, undo)
        session = prepare_session(configuration, options, Diagnostics(is_quiet=True))
        undo.callback(session.opened.devices.close)
        controller = make_controller(session, is_inline=True, on_frame=[], undo=undo)
        undo.callback(controller.close)
        yield session.opened, controller


def light_guides(controller: SessionController) -> None:
    """Register, accept, and check the mirror."""
    controller.step()
    crosses = [ConfirmCross()] * _N_CROSSES
    for command in (Register(), Accept(None), CheckMirror(), *crosses):
        give(controller, command)


def give(controller: SessionController, command: Command) -> None:
    """A command, and the frame after it."""
    controller.submit(command)
    controller.step()
    controller.step()


def draw_all(controller: SessionController) -> np.ndarray:
    """(h, w, 3) all layers of the stage for the display, as the eye reads it.

    Those as well that a session leaves unlit.
    """
    composer, tracked = controller._presenter._composer, controller._session.tracked
    view, now = composer.mirror_view, controller.snapshot
    assert view is not None
    assert tracked is not None
    # As if every layer were certain enough to be lit; the status line then tells no error.
    snapshot = replace(now, layers=now.stage.layers, mirror_error=None)
    picture = composer.compose_mirror(snapshot, tracked.foreground, None)
    # What turns a picture for the display turns it back, too.
    return view.eye_view.to_display(picture)


def see(opened: OpenedDevices, shown: np.ndarray) -> np.ndarray:
    """(H, W, 3) what the eye sees of the site and of a display's picture now."""
    camera, clock = opened.devices.camera, opened.devices.clock
    world = camera._world
    eye = SimulatedEye(world, make_practice_setup(world.rig), _WIDTH, _HEIGHT, _N_SAMPLES)
    return eye.expose(eye.render_site(camera.world_time_ns(clock.now_ns())), shown)


def write(path: Path, picture: np.ndarray) -> None:
    """A JPEG file."""
    if not cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]):
        raise OSError(f"{path} cannot be written")


if __name__ == "__main__":
    sys.exit(main())

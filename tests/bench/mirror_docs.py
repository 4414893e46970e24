"""Makes the pictures of docs/mirror.md: the implant stage of `navapp run --mirror`.

usage: python -m tests.bench.mirror_docs [FOLDER]

Writes mirror_view.jpg (what the simulated eye sees after the check of the mirror, with the layers
that the stage's tolerance allows) and mirror_display.jpg (all layers of the stage, as the eye reads
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
from navapp.control.controller import SessionController
from navapp.control.states import (
    Accept,
    CheckMirror,
    Command,
    ConfirmCross,
    EnterStage,
    Register,
    ToggleLayer,
)
from navapp.devices import OpenedDevices
from sim_devices.mirror_setups import make_practice_setup
from sim_devices.simulated_eye import SimulatedEye

_IMPLANT, _N_CROSSES = 3, 3
# The bone's far side and the vessels behind it are more than 1 mm off for an eye 10 mm beside.
_OFF = ("bone", "risks")
_WIDTH, _HEIGHT, _N_SAMPLES = 1280, 800, 4
_QUALITY = 92


def main() -> int:
    """Run the session and write both pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/images")
    with practice() as (opened, controller):
        light_guides(controller)
        for command in (EnterStage(_IMPLANT), *map(ToggleLayer, _OFF)):
            give(controller, command)
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

    With the error of all of them on the status line, and whether that is allowed or not.
    """
    composer, tracked = controller._composer, controller._session.tracked
    view, judge, now = composer.mirror_view, controller._maker.mirror_judge, controller.snapshot
    assert view is not None
    assert judge is not None
    assert tracked is not None
    layers = now.stage.layers
    error = judge.judge(now.stage, layers, tracked, now.time_ns)
    snapshot = replace(now, layers=layers, mirror_error=error)
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

"""The built-in simulated mirror of `navapp run --mirror`, configured as a calibrated one is."""

import tempfile
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from navapp.errors import UsageError

if TYPE_CHECKING:
    from navapp.config import Configuration


def add_practice_mirror(configuration: "Configuration", undo: ExitStack) -> "Configuration":
    """The configuration with the file of the simulated display in it; removed with `undo`.

    Raises:
        UsageError: something in it is real, or calibrated.
    """
    from navapp.devices import make_practice_display
    from navapp.geometry.display_model_files import write_display_model

    display = configuration.display
    refused = {
        "the camera": configuration.camera.backend != "simulated",
        "the display": display.backend != "simulated",
        "the projector": configuration.projector.backend != "none",
        "the mirror's mount": configuration.mirror.backend != "fixed",
    }
    for what, is_real in refused.items():
        if is_real:
            raise UsageError(
                f"--mirror is for simulated devices, and {what} is not",
                remedy="leave --mirror away, or configure none",
            )
    if display.model is not None:
        raise UsageError("--mirror has its own display", remedy="remove [display] model")
    model = make_practice_display(date.today())
    folder = undo.enter_context(tempfile.TemporaryDirectory(prefix="navapp-mirror-"))
    path = Path(folder) / "display.yml"
    write_display_model(path, model)
    shown = {
        "model": str(path),
        "size_px": (model.screen.width_px, model.screen.height_px),
        "flip_horizontally": False,
        "flip_vertically": False,
    }
    # One eye looks: its place is the calibrated one, and the other one is covered.
    return configuration.model_copy(
        update={
            "display": display.model_copy(update=shown),
            "mirror": configuration.mirror.model_copy(update={"eyes": model.viewing_eye}),
        }
    )

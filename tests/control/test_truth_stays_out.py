"""The controller and the pipeline never get hold of the truth."""

import gc
import subprocess
import sys
import types
from contextlib import ExitStack

import pytest

PACKAGES = ("control", "tracking", "stereo", "registration", "overlay", "preop")

IMPORT_ALL = """
import importlib, pkgutil, sys
for name in {packages!r}:
    package = importlib.import_module("navapp." + name)
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)
sys.stdout.write(" ".join(sys.modules))
"""


def test_no_module_of_the_pipeline_or_the_controller_loads_the_simulator() -> None:
    code = IMPORT_ALL.format(packages=PACKAGES)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "navapp.control.controller" in loaded
    assert not {name for name in loaded if name.split(".")[0] == "sim_devices"}


def reachable(root: object, not_through: set[int]) -> list[object]:
    """Everything that can be got from an object, modules and classes aside."""
    seen, waiting, found = set(not_through), [root], []
    while waiting:
        item = waiting.pop()
        if id(item) in seen or isinstance(item, types.ModuleType | type | types.CodeType):
            continue
        seen.add(id(item))
        found.append(item)
        parts = gc.get_referents(item)
        if isinstance(item, types.FunctionType):
            # What a function closes over, not the whole module around it.
            parts = [*(item.__closure__ or ()), item.__defaults__, item.__kwdefaults__]
        waiting += parts
    return found


@pytest.fixture(params=[False, True], ids=["video", "mirror"])
def built(request: pytest.FixtureRequest):
    from navapp.cli.diagnostics import Diagnostics
    from navapp.cli.live_session import make_controller, prepare_session
    from navapp.cli.main import _parser
    from navapp.cli.practice_mirror import add_practice_mirror
    from navapp.config import parse

    configuration = parse({"camera": {"simulated": {"scale": 0.2}}}, "test")
    options = _parser().parse_args(["run", "--headless"] + ["--mirror"] * request.param)
    with ExitStack() as undo:
        if request.param:
            configuration = add_practice_mirror(configuration, undo)
        session = prepare_session(configuration, options, Diagnostics(is_quiet=True))
        undo.callback(session.opened.devices.close)
        controller = make_controller(session, is_inline=True, on_frame=[], undo=undo)
        undo.callback(controller.close)
        controller.step()
        yield session, controller


def test_a_controller_leads_to_no_oracle_and_to_the_world_only_through_its_camera(built) -> None:
    from sim_devices.truth import TruthOracle
    from sim_devices.world import World

    session, controller = built
    camera = session.opened.devices.camera
    allowed = {id(camera), id(session.opened.reopen_camera)}
    # What the eye sees is pictures for the screen; nothing else asks for it.
    allowed.add(id(session.opened.look))
    found = reachable(controller, allowed)
    assert len(found) > 100
    assert not [item for item in found if isinstance(item, TruthOracle | World)]
    # The walk does find them where they are.
    through_camera = reachable(controller, set())
    assert any(isinstance(item, World) for item in through_camera)
    assert not any(isinstance(item, TruthOracle) for item in through_camera)
    assert any(isinstance(item, TruthOracle) for item in reachable(session, set()))

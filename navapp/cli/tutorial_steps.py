"""The four steps of `navapp tutorial`: each runs the verb that it is about."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.tutorial_folder import TutorialFolder
from navapp.cli.tutorial_patient import write_patient

if TYPE_CHECKING:
    from navapp.ui.tutorial.guide import Guide


@dataclass(frozen=True, slots=True)
class Step:
    """One step; `run` tells whether it was gone through to its end."""

    number: int
    title: str
    text: str  # what is done, and what should be seen
    needs: tuple[int, ...]  # numbers of the steps whose results it uses
    run: Callable[[TutorialFolder, Diagnostics], bool]


def _call(
    folder: TutorialFolder, diagnostics: Diagnostics, *arguments: object, guide: Any = None
) -> int:
    """Another verb, on the devices of the tutorial; its exit code."""
    from navapp.cli.main import call

    words = [str(one) for one in arguments]
    diagnostics.say(f"  $ navapp {' '.join(words)}")
    return call(["--config", str(folder.configuration), *words], diagnostics, guide=guide)


def _finish(guide: "Guide[Any]", code: int, diagnostics: Diagnostics) -> bool:
    """Whether a live screen was gone through."""
    if code == 0 and not guide.is_complete:
        diagnostics.say(f"  left after {guide.n_reached} of {guide.n_tasks} things to do")
    return code == 0 and guide.is_complete


def _see_the_room(folder: TutorialFolder, diagnostics: Diagnostics) -> bool:
    from navapp.ui.tutorial.tasks import make_room_guide

    guide = make_room_guide()
    return _finish(guide, _call(folder, diagnostics, "run", guide=guide), diagnostics)


def _calibrate(folder: TutorialFolder, diagnostics: Diagnostics) -> bool:
    from navapp.ui.tutorial.tasks import make_capture_guide

    guide, pairs = make_capture_guide(), folder.find_capture()
    capture = ("calibrate", "capture", "--board", folder.board, "--out", pairs)
    code = _call(folder, diagnostics, *capture, guide=guide)
    if not _finish(guide, code, diagnostics):
        return False
    solve = ("calibrate", "stereo", pairs, "--board", folder.board, "--out", folder.rig)
    if _call(folder, diagnostics, *solve, "--report", folder.report) != 0:
        return False
    diagnostics.say(f"  the rig is {folder.rig}; {folder.report} shows how good it is")
    return True


def _plan(folder: TutorialFolder, diagnostics: Diagnostics) -> bool:
    if not folder.ct.is_file():
        diagnostics.say("  making the CT of the simulated patient: half a minute")
        write_patient(folder)
    source = ("--ct", folder.ct, "--contents", folder.contents, "--side", "right")
    if _call(folder, diagnostics, "plan", *source, "--out", folder.plan, "--replace") != 0:
        return False
    diagnostics.say(f"  look at {folder.plan / 'summary.html'}: the lines are the bones' surfaces")
    return True


def _navigate(folder: TutorialFolder, diagnostics: Diagnostics) -> bool:
    from navapp.ui.tutorial.tasks import make_navigation_guide

    guide = make_navigation_guide()
    made = ("--rig", folder.rig, "--plan", folder.plan)
    return _finish(guide, _call(folder, diagnostics, "run", *made, guide=guide), diagnostics)


STEPS = (
    Step(
        1,
        "see the room",
        "A simulated knee is operated on: an opened joint, two cameras above it, a leg\n"
        "that breathes. You let the bone be found, accept it, confirm the time-out, and\n"
        "see the guides over the picture. The lines above the picture tell each key.",
        (),
        _see_the_room,
    ),
    Step(
        2,
        "calibrate the rig",
        "Before cameras can measure, they see a printed board from many sides. A\n"
        "simulated hand holds it where it is wanted; you see each view being asked for\n"
        "and kept, and the predicted error fall. Then the rig is solved and judged: it\n"
        "should be accepted, with a predicted error below 0.3 mm.",
        (),
        _calibrate,
    ),
    Step(
        3,
        "plan from a CT",
        "A CT of the same simulated patient becomes a plan: femur, tibia and patella are\n"
        "told apart, and a hole is planned in the femur. There is no screen; a minute or\n"
        "two of work, then the sizes of three bones, and a page with their pictures.",
        (),
        _plan,
    ),
    Step(
        4,
        "navigate",
        "The session of step 1 once more, now with the rig that you calibrated and the\n"
        "plan from the CT. You register, pass the gate to the second stage, and see the\n"
        "planned hole where the drill enters.",
        (2, 3),
        _navigate,
    ),
)

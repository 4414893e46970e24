"""`navapp tutorial`: four steps on simulated devices, from the room to a navigated knee."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from navapp.cli.diagnostics import Diagnostics, check_writable, report, write_json
from navapp.cli.tutorial_folder import TutorialFolder
from navapp.cli.tutorial_steps import STEPS, Step
from navapp.errors import NavappError, UsageError

_EXAMPLE = """\
examples:
  navapp tutorial                        begins, or goes on, in the folder navapp-tutorial
  navapp tutorial --out mine --step 3    in another folder, from the third step on

The steps: see the room, calibrate the rig, plan from a CT, navigate. Some 15 minutes, without any
hardware. What was made is kept, so that it can be left and gone on with.
"""
_KEYS = "  ENTER begins, s skips, q quits: "


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "tutorial",
        help="learn it in four steps, on simulated devices",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--out", metavar="DIR", default="navapp-tutorial", help="folder for everything it makes"
    )
    parser.add_argument(
        "--step", metavar="N", type=int, help="begin with this step (default: the first open one)"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Lead through the steps; left early is no error."""
    if options.step is not None and not 1 <= options.step <= len(STEPS):
        raise UsageError(f"--step {options.step} does not exist", remedy="give 1 to 4")
    if options.config is not None:
        raise UsageError(
            "the tutorial has simulated devices of its own", remedy="leave --config away"
        )
    check_writable(options.json)
    if not _has_terminal():
        raise UsageError(
            "the tutorial needs a terminal: it asks before each step, and shows live screens",
            remedy="start it in one",
        )
    folder = TutorialFolder(Path(options.out))
    folder.begin()
    diagnostics.say(f"navapp tutorial, in the folder {folder.path}: research software, not for")
    diagnostics.say("clinical use; everything in it is simulated.")
    seconds: dict[int, float] = {}
    for step in STEPS[_first(folder, options.step) - 1 :]:
        _show_list(folder, diagnostics)
        if not _lead(step, folder, diagnostics, seconds):
            break
    _show_list(folder, diagnostics)
    done = folder.read_done()
    if len(done) == len(STEPS):
        diagnostics.say("\nThat was the tutorial. Next: docs/README.md, and `navapp run --mirror`.")
    steps = [
        {"number": s.number, "title": s.title, "done": s.number in done,
         "seconds": seconds.get(s.number)}
        for s in STEPS
    ]  # fmt: skip
    write_json(options.json, "tutorial", {"folder": str(folder.path), "steps": steps})
    return 0


def _has_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _first(folder: TutorialFolder, wanted: int | None) -> int:
    """Number of the step to begin with."""
    if wanted is not None:
        return wanted
    done = folder.read_done()
    return next((step.number for step in STEPS if step.number not in done), 1)


def _show_list(folder: TutorialFolder, diagnostics: Diagnostics) -> None:
    """All steps, ticked where they are done."""
    done = folder.read_done()
    diagnostics.say("")
    for step in STEPS:
        diagnostics.say(f"  [{'x' if step.number in done else ' '}] {step.number} {step.title}")


def _lead(
    step: Step, folder: TutorialFolder, diagnostics: Diagnostics, seconds: dict[int, float]
) -> bool:
    """Explain a step and do it, as often as it is wanted; False: somebody wants to quit."""
    diagnostics.say(f"\nStep {step.number} of {len(STEPS)}: {step.title}.\n\n{step.text}\n")
    while (answer := _ask()) != "s":
        if answer == "q":
            return False
        missing = [number for number in step.needs if number not in folder.read_done()]
        if missing:
            numbers = " and ".join(str(number) for number in missing)
            diagnostics.say(f"  it needs what step {numbers} makes: navapp tutorial --step "
                            f"{missing[0]} --out {folder.path}")  # fmt: skip
            continue
        begun = time.monotonic()
        try:
            is_done = step.run(folder, diagnostics)
        except NavappError as error:
            report(str(error))
            is_done = False
        seconds[step.number] = seconds.get(step.number, 0.0) + time.monotonic() - begun
        if is_done:
            folder.mark_done(step.number)
            return True
        diagnostics.say("  the step is not done yet")
    return True


def _ask() -> str:
    """ENTER (an empty text), s or q; the end of the input is q."""
    while True:
        try:
            answer = input(_KEYS).strip().lower()
        except EOFError:
            return "q"
        if answer in ("", "s", "q"):
            return answer

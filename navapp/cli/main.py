"""The argument parser, and the conversion of errors to exit codes."""

import argparse
import difflib
import importlib
import os
import re
from collections.abc import Sequence
from typing import Any, NoReturn

from navapp import __version__
from navapp.cli.diagnostics import Diagnostics, report
from navapp.errors import NavappError

# Verb -> module with `add_parser(subparsers)` and `run(arguments, diagnostics) -> int`.
_VERBS = (
    "run",
    "tutorial",
    "replay",
    "plan",
    "prior",
    "stereo",
    "register",
    "calibrate",
    "accuracy-test",
    "evaluate",
    "rig",
    "devices",
    "doctor",
    "config",
    "completion",
)


def run(arguments: Sequence[str]) -> int:
    """Parse, do, and answer with the exit code of cli.md's table."""
    parser = _parser()
    try:
        options = parser.parse_args(arguments)
    except SystemExit as leaving:
        # argparse leaves with 0 for --help and 2 for wrong usage, as we do.
        return int(leaving.code or 0)
    if options.no_color:
        # The screen's toolkit asks for it, as many programs do.
        os.environ["NO_COLOR"] = "1"
    diagnostics = Diagnostics(is_verbose=options.verbose, is_quiet=options.quiet)
    module = _module_of(options.verb)
    try:
        return int(module.run(options, diagnostics))
    except KeyboardInterrupt:
        report("interrupted")
        return 130
    except NavappError as error:
        if options.debug:
            raise
        report(str(error))
        return error.exit_code
    except BrokenPipeError:
        return 0
    except Exception as error:
        if options.debug:
            raise
        report(
            f"unexpected {type(error).__name__}: {error}; run again with --debug before the verb"
        )
        return 1


def call(arguments: Sequence[str], diagnostics: Diagnostics, **more: object) -> int:
    """Do a verb from within another one; its errors are raised.

    Args:
        arguments: as on the command line.
        diagnostics: of the verb that asks.
        more: what no option says.
    """
    options = _parser().parse_args(arguments)
    for name, value in more.items():
        setattr(options, name, value)
    return int(_module_of(options.verb).run(options, diagnostics))


class _Parser(argparse.ArgumentParser):
    """Says which of its words may have been meant."""

    def error(self, message: str) -> NoReturn:
        """Add what is near to a word that is none of the choices."""
        told = re.search(r"invalid choice: '(.+?)' \(choose from (.+)\)", message)
        if told is not None:
            known = [word.strip("' ") for word in told[2].split(",")]
            near = difflib.get_close_matches(told[1], known, 1)
            message += f"; did you mean '{near[0]}'?" if near else ""
        super().error(message)


def _module_of(verb: str) -> Any:
    return importlib.import_module(f"navapp.cli.{verb.replace('-', '_')}")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="navapp",
        description="Markerless navigation for knee replacement. Research software, not for "
        "clinical use.",
        epilog="example: navapp run        (the application on the simulated rig); new here: "
        "navapp tutorial",
    )
    parser.add_argument("--config", metavar="FILE", help="configuration file (TOML)")
    parser.add_argument("--verbose", action="store_true", help="say more: a line a frame")
    parser.add_argument("--quiet", action="store_true", help="say only errors")
    parser.add_argument("--debug", action="store_true", help="show tracebacks")
    parser.add_argument("--no-color", action="store_true", help="no colours on the screen")
    parser.add_argument("--version", action="version", version=f"navapp {__version__}")
    subparsers = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for verb in _VERBS:
        _module_of(verb).add_parser(subparsers)
    return parser

"""`navapp completion`: a script by which a shell completes verbs, options and files."""

import argparse
import sys
from collections.abc import Iterator
from typing import Any

from navapp.cli.diagnostics import Diagnostics

_EXAMPLE = """\
examples, each once:
  navapp completion bash > ~/.local/share/bash-completion/completions/navapp
  navapp completion zsh > ~/.zfunc/_navapp        (a folder of $fpath)
  navapp completion fish > ~/.config/fish/completions/navapp.fish
"""
# What options call a folder.
_FOLDERS = ("DIR", "P", "CT_FOLDER")


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "completion",
        help="a script by which a shell completes verbs, options and files",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="which one")


def run(options: argparse.Namespace, _diagnostics: Diagnostics) -> int:
    """Print the script; it is the result, whatever --quiet says."""
    sys.stdout.write(make_script(options.shell) + "\n")
    return 0


def make_script(shell: str) -> str:
    """The script, made from the verbs and options that there are."""
    import shtab

    from navapp.cli.main import _parser

    parser = _parser()
    for action in _list_values(parser):
        is_folder = action.metavar in _FOLDERS
        action.complete = shtab.DIRECTORY if is_folder else shtab.FILE  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell)
    return script


def _list_values(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Arguments of a parser and of its verbs that take free text, which names a file mostly."""
    for action in parser._actions:  # noqa: SLF001
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001
            for inner in action.choices.values():
                yield from _list_values(inner)
        elif action.nargs != 0 and action.choices is None and action.type is None:
            yield action

"""`navapp config`: the configuration in force, or a commented file to start from."""

import argparse
from pathlib import Path
from typing import Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import UsageError


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "config",
        help="the configuration in force, or a commented file to start from",
        epilog="example: navapp config init",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", choices=("show", "init"), help="show it, or write ./navapp.toml")
    parser.add_argument("--out", default=None, metavar="FILE", help="where init writes")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.config import FILE_NAME, Configuration, as_toml, find_file, load
    from navapp.geometry.ply import write_whole

    check_writable(options.json)
    if options.what == "init":
        target = Path(options.out or FILE_NAME)
        if target.exists():
            raise UsageError(f"{target} exists already", remedy="move it away, or choose --out")
        check_writable(str(target))
        write_whole(target, as_toml(Configuration(), True).encode("utf-8"))
        diagnostics.say(f"wrote {target}")
        path, configuration = target, Configuration()
    else:
        found = find_file(options.config)
        configuration = load(found)
        path = found or Path()
        if options.json != "-":
            source = str(found) if found else "defaults (no file found)"
            diagnostics.say(f"# from: {source}\n{as_toml(configuration, False)}".rstrip())
    content = {"path": str(path) or None, "configuration": configuration.model_dump(mode="json")}
    write_json(options.json, "config", content)
    return 0

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
    from navapp.config import FILE_NAME, Configuration, find_file, format_toml, load
    from navapp.geometry.whole_files import write_whole

    check_writable(options.json)
    path: Path | None
    if options.what == "init":
        path, configuration = Path(options.out or FILE_NAME), Configuration()
        if path.exists():
            raise UsageError(f"{path} exists already", remedy="move it away, or choose --out")
        check_writable(str(path))
        write_whole(path, format_toml(configuration, True).encode("utf-8"))
        if options.json != "-":
            diagnostics.say(f"wrote {path}")
    else:
        path = find_file(options.config)
        configuration = load(path)
        if options.json != "-":
            source = "defaults (no file found)" if path is None else str(path)
            diagnostics.say(f"# from: {source}\n{format_toml(configuration, False)}".rstrip())
    content = {
        "path": None if path is None else str(path),
        "configuration": configuration.model_dump(mode="json"),
    }
    write_json(options.json, "config", content)
    return 0

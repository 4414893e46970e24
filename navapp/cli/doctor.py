"""`navapp doctor`: checks of the installation and of the configured devices, with remedies."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ConfigurationError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.inventory.finding import Finding


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "doctor",
        help="what is there, what is missing, and what to do about it",
        description="Look at the installation, at what the system grants, and at the configured "
        "devices, without opening any. Exit code 4 when a session could not begin.",
        epilog="example: navapp doctor",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.inventory.finding import Health

    check_writable(options.json)
    findings = _findings(options.config)
    is_well = all(finding.health is not Health.FAILED for finding in findings)
    content = {"well": is_well, "findings": [_to_json(finding) for finding in findings]}
    write_json(options.json, "doctor", content)
    if options.json != "-":
        diagnostics.say(format_text(findings))
    return 0 if is_well else 4


def format_text(findings: Sequence["Finding"]) -> str:
    """For people: a line each, the remedy below what is not as it should be."""
    from navapp.inventory.finding import Health

    width = max(len(finding.name) for finding in findings)
    lines = []
    for finding in findings:
        lines.append(f"{finding.health.value:<7}  {finding.name:<{width}}  {finding.detail}")
        if finding.health is not Health.OK:
            lines.append(f"{'':<7}  {'':<{width}}  -> {finding.remedy}")
    return "\n".join(lines)


def _findings(config: str | None) -> "list[Finding]":
    from navapp.cli.software_checks import check_software

    try:
        configuration, told = _configuration(config)
    except ImportError:
        # The package that is missing is named among the software.
        return check_software(None)
    return [*check_software(configuration), told, *_device_findings(configuration)]


def _device_findings(configuration: "Configuration") -> "list[Finding]":
    from navapp.inventory.configured_checks import check_configured_devices
    from navapp.inventory.connected_devices import list_all_devices
    from navapp.inventory.system_checks import check_system

    found = list_all_devices()
    return [
        *check_system(configuration, found),
        *check_configured_devices(configuration, found),
    ]


def _configuration(config: str | None) -> "tuple[Configuration, Finding]":
    """The one in force; the defaults in the place of one that is not valid."""
    from navapp.config import Configuration, find_file, load
    from navapp.inventory.finding import Finding, Health

    try:
        path = find_file(config)
        configuration = load(path)
    except ConfigurationError as error:
        told = Finding("configuration", Health.FAILED, error.problem, error.remedy)
        return Configuration(), told
    detail = str(path) if path else "defaults (no file)"
    return configuration, Finding("configuration", Health.OK, detail)


def _to_json(finding: "Finding") -> dict[str, str]:
    is_fine = finding.health.value == "ok"
    return {
        "name": finding.name,
        "status": finding.health.value,
        "detail": finding.detail,
        "remedy": "" if is_fine else finding.remedy,
    }

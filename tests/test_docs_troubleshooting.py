"""docs/troubleshooting.md knows every reason, and quotes messages that exist."""

import re
from pathlib import Path

import pytest

from navapp.values import Reason

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
FOLDERS = ("navapp", "calibration", "drivers")


@pytest.mark.parametrize("reason", Reason, ids=lambda reason: reason.name)
def test_every_reason_stands_there_with_why_and_what_to_do(reason: Reason) -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith(f"| {reason.value} |")]
    assert len(rows) == 1
    cells = [cell.strip() for cell in rows[0].strip("|").split("|")]
    assert len(cells) == 3
    assert len(cells[1]) > 20, "why"
    assert reason.remedy in rows[0]


def messages() -> str:
    """All texts of the code, with what was joined or broken over lines in one piece."""
    code = "\n".join(
        path.read_text(encoding="utf-8")
        for folder in FOLDERS
        for path in sorted((ROOT / folder).rglob("*.py"))
    )
    return re.sub(r"\{[^{}]*\}", "...", re.sub(r'"\s*\n\s*f?"', "", code))


def test_what_is_quoted_is_said_somewhere() -> None:
    said = messages()
    quoted = re.findall(r'^\| "([^"]+)"', PAGE, re.MULTILINE)
    assert len(quoted) > 10
    for text in quoted:
        for part in re.split(r"\s*\.\.\.\s*|\bN\b", text):
            assert part.strip() in said, text

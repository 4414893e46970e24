"""What the documentation and the code say of files and headings exists."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = ("navapp", "sim_devices", "drivers", "calibration", "tests")
LINK = re.compile(r"\[[^\]\n]*\]\(([^)\s]+)\)")
MENTION = re.compile(r"docs/[\w/.-]*\w\b(?![*_])")
# "docs/how/registration.md, First registration": a heading of that page.
PLACE = re.compile(r"docs/([\w/]+\.md), \"?([A-Z][\w ]*\w)")


def pages() -> list[Path]:
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def texts() -> list[Path]:
    code = [path for folder in SOURCES for path in sorted((ROOT / folder).rglob("*.py"))]
    return [*pages(), *code, ROOT / "Makefile", ROOT / "pyproject.toml"]


def headings(page: Path) -> list[str]:
    lines = page.read_text(encoding="utf-8").splitlines()
    return [line.lstrip("#").strip() for line in lines if re.match(r"#+ ", line)]


def anchors(page: Path) -> set[str]:
    """As the sites that show Markdown make them of headings."""
    return {
        re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings(page)
    }


def broken_links(page: Path) -> Iterator[str]:
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        if not path.exists() or (anchor and anchor not in anchors(path)):
            yield target


def names_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", pages(), ids=names_of)
def test_every_link_leads_somewhere(page: Path) -> None:
    assert list(broken_links(page)) == []


def test_every_file_of_the_docs_that_is_mentioned_exists() -> None:
    missing = [
        f"{names_of(path)}: {name}"
        for path in texts()
        if path != Path(__file__)
        for name in MENTION.findall(path.read_text(encoding="utf-8"))
        if not (ROOT / name).exists()
    ]
    assert missing == []


def test_every_heading_that_is_mentioned_exists() -> None:
    missing = [
        f"{names_of(path)}: {page}, {heading}"
        for path in texts()
        if path != Path(__file__)
        for page, heading in PLACE.findall(path.read_text(encoding="utf-8"))
        if not any(heading in known for known in headings(ROOT / "docs" / page))
    ]
    assert missing == []


def test_every_page_is_in_the_index() -> None:
    index = ROOT / "docs" / "README.md"
    listed = {
        (index.parent / target.partition("#")[0]).resolve()
        for target in LINK.findall(index.read_text(encoding="utf-8"))
    }
    assert {page for page in pages()[1:] if page != index} <= listed


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("# A heading, it is\n", encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(
        "[a](there.md) [b](gone.md) [c](there.md#a-heading-it-is) [d](there.md#no) [e](#self)\n"
        "# Self\n",
        encoding="utf-8",
    )
    assert list(broken_links(page)) == ["gone.md", "there.md#no"]

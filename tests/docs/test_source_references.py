"""What the documentation says of the source is there: files, and the functions that compute an equation."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
COMPUTED = re.compile(r"omputed by ((?:`\w+`(?:, | and )?)+) in\s+`([\w/]+\.py)`")


def text_of(page: Path) -> str:
    """Return a page's text without its blocks of code."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_python_file_that_a_page_names_exists(page: Path) -> None:
    named = set(re.findall(r"`((?:[\w.-]+/)*[a-z_]\w*\.py)`", text_of(page)))
    files = {str(path.relative_to(ROOT)) for path in ROOT.glob("[a-z]*/**/*.py")}
    assert sorted(name for name in named if not any(f"/{file}".endswith(f"/{name}") for file in files)) == []


def equations() -> list[tuple[str, str]]:
    """Return each file and function that the model page names."""
    found = COMPUTED.findall(text_of(ROOT / "docs" / "model.md"))
    return [(path, name) for names, path in found for name in re.findall(r"`(\w+)`", names)]


@pytest.mark.parametrize(("path", "name"), equations())
def test_each_equation_is_computed_where_the_model_page_says(path: str, name: str) -> None:
    tree = ast.parse((ROOT / "services" / path).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_model_page_names_the_functions_of_the_whole_model() -> None:
    assert len(equations()) >= 11


def test_the_layout_shows_every_package() -> None:
    page = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")
    layout = page[page.index("## The layout") : page.index("## The tests")]
    rooms = {path.parent.parent.name for path in ROOT.glob("services/*/shift_*/__init__.py")}
    assert [room for room in sorted(rooms) if not re.search(rf"\b{room}\b", layout)] == []


CITED = re.compile(r"docs/([a-z0-9-]+\.md)(?:, (section|row)s? ([\d.]+)|, \"([^\"\n]+)\")?")


def test_every_page_section_and_row_that_the_source_cites_exists() -> None:
    missing = []
    for file in ROOT.glob("[a-z]*/**/*.py"):
        for name, kind, number, heading in CITED.findall(file.read_text(encoding="utf-8")):
            page = ROOT / "docs" / name
            text = page.read_text(encoding="utf-8") if page.exists() else ""
            start = {"section": rf"^##+ {number.rstrip('.')}[. ]", "row": rf"^\| {number} \|"}.get(kind, "")
            wanted = start or (rf"^##+ {re.escape(heading)}$" if heading else "")
            if not page.exists() or not re.search(wanted, text, re.MULTILINE):
                missing.append((str(file.relative_to(ROOT)), name, kind, number, heading))
    assert missing == []

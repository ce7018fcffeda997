"""docs/promises.md names tests that are there, and what it says of XML is so."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import imgquad_core
import imgquad_mesh
from support import ROOT

PAGE = ROOT / "docs" / "promises.md"
SOURCES = [f for package in (imgquad_core, imgquad_mesh) for f in Path(package.__file__ or "").parent.rglob("*.py")]
PARSERS = re.compile(r"xml\.(etree|dom|sax\.expatreader|parsers)|lxml|html5lib|bs4")


def named() -> list[str]:
    return sorted(set(re.findall(r"`((?:tests|benchmarks)/[\w/.]+)", PAGE.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("name", named())
def test_what_the_page_of_promises_names_is_there(name: str) -> None:
    assert (ROOT / name).exists()


def test_the_single_tests_that_it_names_are_there() -> None:
    tests = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "tests").rglob("test_*.py"))
    for function in re.findall(r"::(test_\w+)", PAGE.read_text(encoding="utf-8")):
        assert f"def {function}(" in tests, function


def test_the_sections_of_the_campaign_that_it_names_are_there() -> None:
    import faults

    text = PAGE.read_text(encoding="utf-8")
    for said in re.findall(r"`benchmarks/faults.py(?:` \(([^)]*)\)| ([\w -]+)`)", text):
        for section in re.findall(r"[a-z-]+", " ".join(said)):
            assert section in faults.SECTIONS


def test_xml_is_parsed_by_defusedxml_only() -> None:
    for file in SOURCES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert not [a.name for a in node.names if PARSERS.match(a.name)], file
            if isinstance(node, ast.ImportFrom) and PARSERS.match(node.module or ""):
                assert {a.name for a in node.names} <= {"Element"}, file  # the type alone

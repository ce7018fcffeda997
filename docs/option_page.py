"""The page of all options, made of what the options declare: `python docs/option_page.py` writes docs/options.md."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from imgquad_core import MeshOptions
from imgquad_core.declared import declarations
from imgquad_core.fe import ElementOptions
from imgquad_mesh.cli.declared_options import flag_of, form_of
from imgquad_mesh.texts import TEXTS

PAGE = Path(__file__).with_name("options.md")
HEAD = """# Options

What `imgquad-mesh run` takes, and `MeshOptions` in Python (`edge_ratio` for `--edge-ratio`). `imgquad-mesh run --help`
lists those of solver files and outputs, too. This page is made by `python docs/option_page.py`.
"""


def text() -> str:
    """Return the page."""
    return "\n".join([HEAD, *_tables(MeshOptions), *_tables(ElementOptions)]).rstrip() + "\n"


def _tables(options: type) -> Iterator[str]:
    declared = declarations(options)
    for topic in dict.fromkeys(declaration.topic for declaration in declared.values()):
        yield from (f"## {topic.capitalize()}", "", "| option | default | meaning |", "|---|---|---|")
        for name, declaration in declared.items():
            if declaration.topic == topic:
                form = f"{flag_of(name)} {form_of(name, declaration)}".rstrip().replace("|", "\\|")
                repeatable = " Repeatable." if name in TEXTS and TEXTS[name].item else ""
                field = f" `{name}`" if flag_of(name) != f"--{name.replace('_', '-')}" else ""
                yield f"| `{form}`{field} | {declaration.default_text} | {declaration.text}{repeatable} |"
        yield ""


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")

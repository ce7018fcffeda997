"""Options of the command, made of what the core's options declare."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from imgquad_core.declared import Declaration, declarations
from imgquad_mesh.texts import TEXTS, flag_of, number

_READ: Mapping[type, Callable[[str], Any]] = {int: int, float: number, str: str}


def add_declared(parser: argparse.ArgumentParser, options: type) -> None:
    """Add an option for each that `options` declares, under the headings of their topics."""
    declared = declarations(options)
    for topic in dict.fromkeys(sorted((d.topic for d in declared.values()), key=_TOPICS.index)):
        group = parser.add_argument_group(topic)
        for name, declaration in declared.items():
            if declaration.topic == topic:
                group.add_argument(flag_of(name), dest=name, **_how(name, declaration))


def asked(args: argparse.Namespace, options: type) -> dict[str, Any]:
    """Return the values of `options` that were given."""
    given = {name: getattr(args, name) for name in declarations(options)}
    return {
        name: TEXTS[name].gather(value) if isinstance(value, list) and name in TEXTS and TEXTS[name].item else value
        for name, value in given.items()
        if value is not None
    }


def form_of(name: str, declaration: Declaration) -> str:
    """Return what stands behind the option, as help and docs show it; empty for a flag."""
    if declaration.kind is bool:
        return ""
    if name in TEXTS:
        return TEXTS[name].form
    if declaration.choices:
        return "|".join(map(str, declaration.choices))
    return "N" if declaration.kind is int else (declaration.what or "a number").split()[-1].upper()


_TOPICS = ("picture", "noise", "boundaries", "mesh", "elements")


def _how(name: str, declaration: Declaration) -> dict[str, Any]:
    told = f" (default: {declaration.default_text})" if declaration.default_text else ""
    how: dict[str, Any] = {"help": f"{declaration.help}{told}".replace("%", "%%"), "default": None}
    if declaration.kind is bool:
        return how | {"action": "store_true"}
    text, form = TEXTS.get(name), {"metavar": form_of(name, declaration)}
    if text and text.item:
        how["help"] += "; repeatable"
        return how | form | {"type": text.item, "action": "append"}
    how |= {"type": text.read if text else _READ[declaration.kind]}
    return how | ({"choices": declaration.choices} if declaration.choices else form)

"""An option is declared once: its default, limits, choices and help.

`option` makes it a field of a stage's options, `same_as` takes it over into other options, as `MeshOptions` does with
nearly all. `check` refuses values outside the limits. The parser of the command, the checks of the PyVista filters and
the table of the docs are made of `declarations`; filters.xml and the signatures are held against them by tests.

This module and those that hold options import no NumPy: the command's help waits for them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Integral, Real
from typing import Any

from .errors import InputError

_WHAT = {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}
LARGEST = 1e30  #: number that an option may have: its square is no infinity
_TYPES: Mapping[type, type] = {bool: bool, str: str}


@dataclass(frozen=True)
class Declaration:
    """What is said of an option, once.

    Parameters
    ----------
    default : object
        Value of those who do not ask.
    help : str
        What it does: no capital, no full stop.
    kind : type
        int, float, bool or str; object where the options check the value themselves.
    what : str
        What to give, for the error text: "a length".
    least, most, above : float, optional
        Limits: `least` and `most` may be had, `above` not.
    unit : str
        Of the limits: "px".
    choices : tuple
        All values there are.
    word : str
        Given in place of a value: "auto".
    each : str
        Where the value is a mapping, whose values have the limits: how one of them is called, with {} for its key.
    told : str
        The default in words, where the value does not tell it.
    topic : {"picture", "noise", "boundaries", "mesh", "elements"}
        Heading under which the command and the docs list it.
    """

    default: Any
    help: str
    kind: type = object
    what: str = ""
    least: float | None = None
    most: float | None = None
    above: float | None = None
    unit: str = ""
    choices: tuple[Any, ...] = ()
    word: str = ""
    each: str = ""
    told: str = ""
    topic: str = "mesh"

    def field(self) -> Any:
        """Return the field of a dataclass."""
        metadata = {"declaration": self}
        if isinstance(self.default, Mapping):  # dataclasses take it for one that can be changed
            return field(default_factory=lambda: self.default, metadata=metadata)
        return field(default=self.default, metadata=metadata)

    @property
    def text(self) -> str:
        """The help as a sentence."""
        return f"{self.help[0].upper()}{self.help[1:]}."

    @property
    def default_text(self) -> str:
        """The default in words; empty where there is none, or it is false."""
        if self.told or self.default is None or self.default is False or isinstance(self.default, Mapping | tuple):
            return self.told
        return f"{self.default:g}" if isinstance(self.default, float) else str(self.default)

    @property
    def wanted(self) -> str:
        """What to give: "a length of at least 0.05 px"."""
        if self.choices:
            return f"one of {', '.join(map(str, self.choices))}"
        what, unit = self.what or _WHAT.get(self.kind, "another value"), f" {self.unit}" if self.unit else ""
        if self.least is not None and self.most is not None:
            text = f"{what} from {self.least:g} to {self.most:g}{unit}"
        elif self.least is not None:
            text = f"{what} of at least {self.least:g}{unit}"
        else:
            text = what if self.above is None else f"{what} above {self.above:g}{unit}"
        return f"{self.word}, or {text}" if self.word else text

    def allows(self, value: Any) -> bool:
        """Tell whether `value` has the right type and is within the limits."""
        if self.kind in _TYPES and not self.choices:
            return isinstance(value, _TYPES[self.kind])
        if type(value) is bool:
            return self.kind is object
        if self.choices:
            return isinstance(value, (str, Integral)) and value in self.choices
        return self.kind is object or (isinstance(value, Real) and self._holds(value))

    def _holds(self, number: Any) -> bool:
        if not -LARGEST <= number <= LARGEST:
            return False
        if self.kind is int and number != int(number):
            return False
        if self.above is not None and not number > self.above:
            return False
        return (self.least is None or number >= self.least) and (self.most is None or number <= self.most)

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` where the option `name` does not allow `value`."""
        if (value is None and self.default is None) or (self.word and isinstance(value, str) and value == self.word):
            return
        if not self.each:
            if not self.allows(value):
                raise InputError(f"{name} is {value!r}; give {self.wanted}")
            return
        if not isinstance(value, Mapping):
            raise InputError(f"{name} is {value!r}; give a mapping to {self.wanted}")
        for key, each in value.items():
            if not self.allows(each):
                raise InputError(f"{self.each.format(key)} is {each!r}; give {self.wanted}")


def option(default: Any, help: str, **more: Any) -> Any:
    """Declare an option as the field of a dataclass; see `Declaration` for what can be said of it."""
    more.setdefault("kind", type(default) if type(default) in _WHAT else object)
    return Declaration(default, help, **more).field()


def same_as(options: type, name: str, **changes: Any) -> Any:
    """Return the field of an option that other options declare already, with what is different here."""
    return replace(declarations(options)[name], **changes).field()


def declarations(options: type) -> dict[str, Declaration]:
    """Return what a dataclass declares, by name, in order."""
    return {f.name: f.metadata["declaration"] for f in fields(options) if "declaration" in f.metadata}


def check(options: Any) -> None:
    """Raise `InputError` for the first value that its declaration does not allow."""
    for name, declaration in declarations(type(options)).items():
        declaration.check(name, getattr(options, name))


# options that several stages have

SIZE = Declaration(4.0, "length of the final edges, in pixels", float, "a length", least=0.05, unit="px")
GROWTH = Declaration(
    1.3,
    "largest ratio of the sizes of neighbouring elements; inside regions up to 1.6",
    float,
    "a ratio",
    least=1.01,
    most=10.0,
)
MATERIAL_SIZES = replace(
    SIZE,
    default=None,
    help="length of the final edges in single materials, by name or number, in pixels",
    each="size of material {}",
)
SIZES_BETWEEN = replace(
    MATERIAL_SIZES,
    help="length of the final edges on boundaries between two materials, by names or numbers, in pixels",
    each="size between {}",
)
POLICIES = ("minority", "majority", "lower", "diagonal", "junction")
POLICY = Declaration(
    "minority",
    "which pair is joined where two materials form a checkerboard of 2 x 2 pixels: that of the material with fewer "
    "pixels nearby, which keeps thin lines whole (minority), the other one (majority), that of the lower number "
    "(lower), always the same diagonal (diagonal), or none (junction)",
    str,
    choices=POLICIES,
    topic="boundaries",
)
EFFORT = Declaration("normal", "how far the mesh is optimised", str, choices=("fast", "normal", "best"))
THREADS = Declaration(
    0, "number of threads, 0: one for each core that may be used; the mesh does not depend on it", int, least=0
)

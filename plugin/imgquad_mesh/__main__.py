"""The command `imgquad-mesh`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn

from imgquad_core.errors import ImgquadError, InputError, QualityError

from .cli import demo, list_filters, run, script

GOOD, BUG, BAD_INPUT, LIMIT_NOT_MET, INTERRUPTED = 0, 1, 2, 3, 130
COMMANDS = (run, demo, script, list_filters)


class Parser(argparse.ArgumentParser):
    """A parser whose errors take one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and exit with code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command with all its subcommands."""
    parser = Parser(
        prog="imgquad-mesh",
        description="Turns any picture of a structure into an all-quadrilateral, multi-material finite element mesh.",
        epilog="exit codes: 0 good, 2 bad input, 3 an asked limit was not met (the mesh is written all the same)",
    )
    parser.add_argument("--version", action="version", version=_version())
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)
    for command in COMMANDS:
        command.add_parser(subparsers)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    args = build_parser().parse_args(argv)
    try:
        return int(args.execute(args))
    except QualityError as error:
        return _failed(error, LIMIT_NOT_MET)
    except InputError as error:
        return _failed(error, BAD_INPUT)
    except ImgquadError as error:
        return _failed(f"{error} (a bug of imgquad-mesh: please report it with the picture)", BUG)
    except MemoryError:
        return _failed("out of memory: crop the picture (--crop), or ask for larger elements (--size)", BAD_INPUT)
    except BrokenPipeError:
        return GOOD
    except KeyboardInterrupt:
        return _failed("interrupted", INTERRUPTED)


def _failed(reason: object, code: int) -> int:
    print("imgquad-mesh: error:", " ".join(str(reason).split()), file=sys.stderr)
    return code


def _version() -> str:
    from importlib.metadata import version

    return f"imgquad-mesh {version('imgquad-mesh')}"


if __name__ == "__main__":
    sys.exit(main())

"""The command `imgquad-mesh`."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from typing import Any, NoReturn

from imgquad_core.errors import ImgquadError, InputError, QualityError
from imgquad_core.whole_files import remove_scratch

from . import cli
from .cli.interruption import handling_signals, is_working

GOOD, BUG, BAD_INPUT, LIMIT_NOT_MET = 0, 1, 2, 3
BY_SIGNAL = 128  #: plus the number of the signal, as shells have it


class Parser(argparse.ArgumentParser):
    """A parser whose errors take one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and exit with code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    """Print the version, which is looked up when it is asked for: that takes longer than all else here."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from importlib.metadata import version

        print(f"imgquad-mesh {version('imgquad-mesh')}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command with all its subcommands."""
    parser = Parser(
        prog="imgquad-mesh",
        description="Turns any picture of a structure into an all-quadrilateral, multi-material finite element mesh.",
        epilog="exit codes: 0 good, 2 bad input, 3 an asked limit was not met (the mesh is written all the same)",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)
    commands = (cli.run, cli.stack, cli.tiles, cli.demo, cli.studio, cli.script, cli.list_filters, cli.warm)
    for command in commands:
        command.add_parser(subparsers)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names of files that the terminal cannot show
    with handling_signals() as interruption:  # before anything is loaded, which takes its time
        try:
            args = build_parser().parse_args(argv)
            return int(args.execute(args))
        except BrokenPipeError:
            return GOOD
        except Exception as error:
            if interruption.signal is None:
                return _failed(*_told(error))
        except KeyboardInterrupt:
            pass
    code = _failed("interrupted", BY_SIGNAL + (interruption.signal or signal.SIGINT))
    if is_working():  # Python would wait for it
        remove_scratch()
        sys.stdout.flush()
        os._exit(code)
    return code


def _told(error: Exception) -> tuple[object, int]:
    """Return what to say of an error, and the exit code; raise it where it is none of ours."""
    if isinstance(error, QualityError):
        return error, LIMIT_NOT_MET
    if isinstance(error, InputError):
        return error, BAD_INPUT
    if isinstance(error, ImgquadError):
        return f"{error} (a bug of imgquad-mesh: please report it with the picture)", BUG
    if isinstance(error, MemoryError):
        return "out of memory: crop the picture (--crop), or ask for larger elements (--size)", BAD_INPUT
    raise error


def _failed(reason: object, code: int) -> int:
    print("imgquad-mesh: error:", " ".join(str(reason).split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())

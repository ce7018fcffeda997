"""`imgquad-mesh studio`: a page on which a picture becomes a mesh, for those without Python."""

from __future__ import annotations

import argparse
import socket
from pathlib import Path
from typing import Any

from imgquad_core.errors import InputError
from imgquad_mesh.texts import number, whole


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Open a page in the browser on which a picture becomes a mesh. This machine serves it to itself only."
    parser = subparsers.add_parser("studio", help="mesh pictures on a page in the browser", description=text)
    add = parser.add_argument
    add("picture", type=Path, metavar="PICTURE", nargs="?", help="a picture to begin with")
    add(
        "--host",
        default="127.0.0.1",
        help="address to serve on, as others call it (default: 127.0.0.1, yours only)",
    )
    add("--port", type=whole, default=0, metavar="N", help="0: a free one (default)")
    add("--no-browser", action="store_true", help="print the address only")
    add("--megabytes", type=whole, default=64, metavar="N", help="largest upload (default: 64)")
    add("--megapixels", type=number, default=16, metavar="N", help="largest picture (default: 16)")
    add("--memory", type=number, default=2.0, metavar="GB", help="data of a page's process at most (default: 2)")
    add("--sessions", type=whole, default=4, metavar="N", help="pages at once (default: 4)")
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Serve until interrupted; return the exit code."""
    try:
        # an extra is needed for these
        from imgquad_mesh.studio.server import Place, serve
        from imgquad_mesh.studio.sessions import Limits
    except ImportError as error:
        raise InputError(f"the studio needs {error.name}: pip install 'imgquad-mesh[studio]'") from error
    if args.picture is not None and not args.picture.is_file():
        raise InputError(f"there is no picture {args.picture}; give the path of a file")
    if args.host in ("0.0.0.0", "::", ""):
        raise InputError(f"host is '{args.host}', which is any; give the address by which others reach this machine")
    limits = Limits(
        bytes=args.megabytes * 1_000_000,
        pixels=int(args.megapixels * 1e6),
        memory=int(args.memory * 1e9),
        sessions=args.sessions,
    )
    with _listening(args.host, args.port) as listening:
        port = listening.getsockname()[1]
        own = () if args.host == "127.0.0.1" else (args.host,)
        place = Place(port, (*own, "127.0.0.1", "localhost", "[::1]"))
        if args.host != "127.0.0.1":
            print(f"warning: whoever reaches {args.host} and has this address can use the studio, unencrypted")
        print(f"the studio is at {place.address} (Ctrl-C ends it)", flush=True)
        if not args.no_browser:
            import webbrowser  # not above: the command loads this module whatever it does

            webbrowser.open(place.address)
        serve(place, limits, args.picture, listening)
    return 0


def _listening(host: str, port: int) -> socket.socket:
    try:
        return socket.create_server((host, port))
    except (OSError, OverflowError) as error:
        raise InputError(f"cannot listen on {host}:{port} ({error}); give another --host or --port") from error

"""The studio's server: a few routes behind a guard. It loads no NumPy: pictures are for the workers."""

from __future__ import annotations

import asyncio
import json
import re
import secrets
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from imgquad_core.declared import declarations
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions
from imgquad_core.options import MeshOptions

from .recipe import recipe_of, safe_name
from .sessions import Busy, Limits, Session, Sessions, start_fork_server

WWW = Path(__file__).with_name("www")
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
#: endings that tell formats which have no mark of their own at their start; all others are told by their content
KNOWN = (".npy", ".npz", ".ang", ".ctf", ".nrrd", ".nii.gz", ".nii", ".mrc", ".mha", ".vti", ".h5oina", ".dream3d")
MOST_JSON = 1_000_000  #: bytes of a recipe
TAB = re.compile("[0-9a-f]{32}")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True)
class Place:
    """Where the studio is served, and to whom."""

    port: int
    hosts: tuple[str, ...] = ("127.0.0.1", "localhost", "[::1]")
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    @property
    def cookie(self) -> str:
        """Name of the cookie that holds the token: browsers send cookies to all ports of a host."""
        return f"studio-{self.port}"

    @property
    def address(self) -> str:
        """What to open."""
        return f"http://{self.hosts[0]}:{self.port}/?token={self.token}"

    def knows(self, host: str) -> bool:
        """Tell whether a Host header, or an Origin without its scheme, is ours."""
        return host in {f"{own}:{self.port}" for own in self.hosts}


class Guard:
    """Refuses foreign names (DNS rebinding), foreign pages, and who has no token: only its page comes through."""

    def __init__(self, app: ASGIApp, place: Place) -> None:
        self._app, self._place = app, place

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it in one line."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        refusal = self._refusal(Request(scope))
        await (refusal or self._app)(scope, receive, with_headers)

    def _refusal(self, request: Request) -> Response | None:
        headers, place = request.headers, self._place
        if not place.knows(headers.get("host", "")):
            return _no(403, "this name is not the studio's: open the address that it printed")
        origin = headers.get("origin")
        if origin is not None and not (origin.startswith("http://") and place.knows(origin[7:])):
            return _no(403, "this page is not the studio's")
        if request.method in ("GET", "HEAD"):
            return None  # only what everybody may read is given, but for what `_post` routes guard
        given = request.cookies.get(place.cookie, "")
        if not secrets.compare_digest(given.encode(), place.token.encode()):
            return _no(403, "no token: open the address that the studio printed")
        if not TAB.fullmatch(headers.get("x-tab", "")):
            return _no(400, "no X-Tab header: load the page anew")
        return None


def _no(code: int, why: str) -> JSONResponse:
    return JSONResponse({"error": why}, code)


class TooMuch(Exception):
    """A body is too long or too slow; holds the answer."""

    def __init__(self, code: int, why: str) -> None:
        super().__init__(why)
        self.code = code


async def _parts(request: Request, most: int, slow: float) -> AsyncIterator[bytes]:
    """Return the parts of a body, of at most so many bytes in all, each within so many seconds."""
    too_long = TooMuch(413, f"more than {most / 1e6:g} MB: crop or shrink the picture")
    length = request.headers.get("content-length", "0")
    if not length.isdigit() or int(length) > most:
        raise too_long
    stream, n = request.stream().__aiter__(), 0
    while True:
        try:
            part = await asyncio.wait_for(anext(stream), slow)
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise TooMuch(408, f"nothing came for {slow:g} seconds: try again") from None
        n += len(part)
        if n > most:
            raise too_long
        yield part


async def _save(request: Request, path: Path, limits: Limits) -> None:
    """Put a body into a new file; nothing stays of one that is refused."""
    try:
        with path.open("xb") as file:
            async for part in _parts(request, limits.bytes, limits.slow):
                file.write(part)
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def make_app(place: Place, sessions: Sessions, picture: Path | None = None) -> ASGIApp:
    """Return the studio as an ASGI application.

    Parameters
    ----------
    place : Place
        Where it is served.
    sessions : Sessions
        What pages have, and may use.
    picture : Path, optional
        A picture to open at the start.
    """
    answers = _Answers(place, sessions, picture)
    posts = ("options", "given", "picture", "marks", "texts", "do", "close")
    routes = [Route("/", answers.page), Route("/{name}", answers.static)]
    routes += [Route(f"/{name}", _told(getattr(answers, name)), methods=["POST"]) for name in posts]
    return Guard(Starlette(routes=routes, lifespan=answers.lifespan), place)


class _Answers:
    """What the page is answered; each method is a route of its name."""

    def __init__(self, place: Place, sessions: Sessions, opened: Path | None) -> None:
        self._place, self._sessions, self._opened = place, sessions, opened
        self._files = {path.name: path.read_bytes() for path in WWW.iterdir() if path.suffix in TYPES}

    async def page(self, request: Request) -> Response:
        response = Response(self._files["index.html"], media_type="text/html")
        if secrets.compare_digest(request.query_params.get("token", "").encode(), self._place.token.encode()):
            response.set_cookie(self._place.cookie, self._place.token, httponly=True, samesite="strict")
        return response

    async def static(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in self._files:
            return _no(404, "there is no such file")
        return Response(self._files[name], media_type=TYPES[Path(name).suffix])

    async def options(self, request: Request) -> Response:
        told = {"options": _declared(), "given": self._opened.name if self._opened else None}
        return JSONResponse(told | {"learns": find_spec("sklearn") is not None})

    async def given(self, request: Request) -> Response:
        if self._opened is None:
            return _no(404, "no picture was given")
        data = await asyncio.to_thread(self._opened.read_bytes)
        return Response(data, media_type="application/octet-stream")

    async def picture(self, request: Request) -> Response:
        session = self._session(request)
        name = safe_name(request.query_params.get("name", ""))
        path = session.new_file(next((end for end in KNOWN if name.lower().endswith(end)), ".picture"))
        await _save(request, path, self._sessions.limits)
        async with session.lock:
            session.took(path, name)
        return JSONResponse({"name": name})

    async def marks(self, request: Request) -> Response:
        session = self._session(request)
        path = session.new_file(".picture")
        await _save(request, path, self._sessions.limits)
        async with session.lock:
            session.took_marks(path)
        return JSONResponse({})

    async def texts(self, request: Request) -> Response:
        return JSONResponse(recipe_of((await _json(request, self._sessions.limits)).get("recipe")).texts)

    async def do(self, request: Request) -> Response:
        task = await _json(request, self._sessions.limits)
        session = self._session(request)
        if task.get("do") not in ("segment", "denoise", "smooth", "mesh", "write", "look", "rock"):
            raise InputError("the studio does nothing of this name")
        if session.picture is None and task["do"] != "rock":
            raise InputError("there is no picture: drop one")
        recipe_of(task.get("recipe"))  # refused here rather than in a process
        return StreamingResponse(_one_at_a_time(session, task), media_type="application/x-ndjson")

    async def close(self, request: Request) -> Response:
        self._sessions.forget(request.headers["x-tab"])
        return JSONResponse({})

    @asynccontextmanager
    async def lifespan(self, app: Starlette) -> AsyncIterator[None]:
        start_fork_server()
        reaper = asyncio.create_task(self._sessions.reap())
        yield
        reaper.cancel()
        self._sessions.end()

    def _session(self, request: Request) -> Session:
        return self._sessions.of(request.headers["x-tab"])


class _Server(uvicorn.Server):
    """Ends the work before it waits for the answers that are under way: they end with it."""

    def __init__(self, app: ASGIApp, sessions: Sessions) -> None:
        super().__init__(uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, limit_concurrency=64))
        self._sessions = sessions

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._sessions.end()
        await super().shutdown(sockets)


def serve(place: Place, limits: Limits, picture: Path | None, listening: socket.socket) -> None:
    """Serve the studio on a socket until it is interrupted."""
    sessions = Sessions(limits)
    _Server(make_app(place, sessions, picture), sessions).run(sockets=[listening])


Answering = Callable[[Request], Awaitable[Response]]


def _told(answer: Answering) -> Answering:
    """Turn what is raised into one line."""

    async def told(request: Request) -> Response:
        try:
            return await answer(request)
        except ClientDisconnect:
            return _no(499, "the page went away")
        except TooMuch as error:
            return _no(error.code, str(error))
        except Busy as error:
            return _no(503, str(error))
        except InputError as error:
            return _no(400, " ".join(str(error).split()))

    return told


async def _json(request: Request, limits: Limits) -> dict[str, Any]:
    body = b"".join([part async for part in _parts(request, MOST_JSON, limits.slow)])
    try:
        found = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise InputError("the request is no JSON: load the page anew") from error
    if not isinstance(found, dict):
        raise InputError("the request is no JSON object: load the page anew")
    return found


async def _one_at_a_time(session: Any, task: dict[str, Any]) -> AsyncIterator[bytes]:
    """Answer when the session's former request is answered; no more than one waits."""
    if session.waiting:
        yield b'{"error": "the page asked for too much at once: try again"}\n'
        return
    session.waiting = True
    try:
        await session.lock.acquire()
    finally:
        session.waiting = False
    lines = session.lines(task)
    try:
        async for line in lines:
            yield line
    finally:
        await lines.aclose()
        session.lock.release()


def _declared() -> Mapping[str, Any]:
    """Return what the page needs to know of all options, in order: for fields that it makes by itself."""
    return {
        name: {
            "topic": declared.topic,
            "help": declared.text,
            "default": declared.default_text,
            "kind": declared.kind.__name__,
            "choices": list(declared.choices),
            "least": declared.least,
            "most": declared.most,
        }
        for options in (MeshOptions, ElementOptions)
        for name, declared in declarations(options).items()
    }

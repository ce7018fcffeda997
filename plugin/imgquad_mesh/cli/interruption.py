"""Ctrl-C, SIGTERM and SIGHUP end the command in order, and at once: what was begun is cleaned up."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import TypeVar

T = TypeVar("T")

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
LATER = 0.05  #: seconds after which a signal that came during an import comes again
WORKER = "imgquad-mesh-work"
STACK = 64 << 20  #: bytes, as main threads have it; others have half a megabyte on some systems
AGAIN = 1.0  #: seconds in which further signals do not disturb the cleaning up


class Interruption:
    """Turns the first signal into a `KeyboardInterrupt`, once no import is under way."""

    def __init__(self) -> None:
        self.signal: int | None = None
        self._raised = -AGAIN

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Note the signal and raise; libraries that load crash, or lose the exception, where it comes in between."""
        self.signal = self.signal or number
        if _is_importing(frame):
            self._again()
        elif monotonic() - self._raised >= AGAIN:
            self._raised = monotonic()
            raise KeyboardInterrupt

    def lost(self, what: sys.UnraisableHookArgs) -> None:
        """Let the signal come again where Python drops its exception, as in callbacks of weak references."""
        if issubclass(what.exc_type, KeyboardInterrupt) and self.signal is not None:
            self._raised = -AGAIN
            self._again()
        else:
            sys.__unraisablehook__(what)

    def _again(self) -> None:
        again = threading.Timer(LATER, signal.raise_signal, [self.signal])
        again.daemon = True
        again.start()


@contextmanager
def handling_signals() -> Iterator[Interruption]:
    """Handle the signals that end a process, but for those that are ignored (nohup) and off the main thread."""
    interruption = Interruption()
    former = {}
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:
                former[number] = signal.signal(number, interruption.handle)
    hook, sys.unraisablehook = sys.unraisablehook, interruption.lost
    try:
        yield interruption
    finally:
        sys.unraisablehook = hook
        for number, handler in former.items():
            signal.signal(number, handler)


def promptly(work: Callable[[], T]) -> T:
    """Return what `work` gives, done in a thread of its own: Python hears of no signal while a kernel runs in this one.

    When a signal ends the wait the work goes on, until the process ends: see `is_working`.
    """
    outcome: Future[T] = Future()
    thread = threading.Thread(target=_settle, args=(outcome, work), name=WORKER, daemon=True)
    usual = threading.stack_size(STACK)
    thread.start()
    threading.stack_size(usual)
    while True:
        thread.join(LATER)  # Windows interrupts no wait without an end
        if outcome.done():
            return outcome.result()


def is_working() -> bool:
    """Whether work of `promptly` goes on that nobody waits for."""
    return any(thread.name == WORKER for thread in threading.enumerate())


def _settle(outcome: Future[T], work: Callable[[], T]) -> None:
    try:
        outcome.set_result(work())
    except BaseException as error:
        outcome.set_exception(error)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False

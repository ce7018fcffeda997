"""Steps that hang on each other: run one by one in this process, on the workers of Dask, or handed over as a graph.

Steps are pure functions of their arguments and of files with fixed names. What they return is small.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple
from uuid import uuid4

from imgquad_core.errors import InputError

#: called with the name of the kind of step that ended, such as "mesh"
Told = Callable[[str], None]


class ClusterError(InputError):
    """The machines that were to do the work are gone."""


class Result(NamedTuple):
    """What the step `key` returns, as an argument of another one."""

    key: str


class Step(NamedTuple):
    """A call: its name ("mesh-0-7"), the function, and arguments, among them `Result`s, also in lists."""

    key: str
    call: Callable[..., Any]
    args: tuple[Any, ...]


class Failed(NamedTuple):
    """What stands for the result of a step whose worker was killed again and again."""

    key: str
    reason: str


def kind_of(key: str) -> str:
    """Return what kind of step a key names: "mesh-0-7" is a mesh."""
    return key.split("-")[0]


def run_here(steps: Iterable[Step], told: Told) -> dict[str, Any]:
    """Run steps in this process, in their order, and return what they return."""
    done: dict[str, Any] = {}
    for step in steps:
        done[step.key] = call(step, done)
        told(kind_of(step.key))
    return done


def call(step: Step, done: Mapping[str, Any]) -> Any:
    """Do a step in this process with the results of others; return what it returns."""
    return step.call(*_put_in(step.args, done, _computed))


def as_delayed(steps: Iterable[Step]) -> dict[str, Any]:
    """Return the steps as `dask.delayed`, named "imgquad-mesh-TOKEN-0-7": the dashboard groups them by kind."""
    import dask  # an extra

    token, made = uuid4().hex[:8], dict[str, Any]()
    for step in steps:
        kind, _, rest = step.key.partition("-")
        name = "-".join(filter(None, ("imgquad", kind, token, rest)))
        delayed = dask.delayed(step.call, pure=False)
        made[step.key] = delayed(*_put_in(step.args, made, lambda value: value), dask_key_name=name)
    return made


def run_on(client: Any, steps: Iterable[Step], told: Told) -> dict[str, Any]:
    """Run steps on the workers of a client; `Failed` stands for those whose workers were killed.

    Raises
    ------
    ClusterError
        The scheduler is gone.
    """
    delayed = as_delayed(steps)
    futures = dict(zip(delayed, client.compute(list(delayed.values())), strict=True))
    keys = {future.key: key for key, future in futures.items()}
    done: dict[str, Any] = {}
    try:
        for future in _completed(client, list(futures.values())):
            key = keys[future.key]
            done[key] = _result(client, key, future)
            told(kind_of(key))
    finally:
        client.cancel(list(futures.values()))
    return {key: done[key] for key in futures}


def _completed(client: Any, futures: list[Any]) -> Iterator[Any]:
    from distributed import as_completed  # an extra

    left = set(futures)
    for future in as_completed(futures, loop=client.loop):
        left.discard(future)
        yield future
    if left:
        raise _lost(client)


def _result(client: Any, key: str, future: Any) -> Any:
    """Return what a future holds."""
    from distributed import KilledWorker  # an extra

    if future.cancelled() or client.status in ("closed", "closing"):
        raise _lost(client)
    try:
        return future.result()
    except KilledWorker as error:
        return Failed(key, f"its worker was killed {error.allowed_failures + 1} times, out of memory most likely")


def _lost(client: Any) -> ClusterError:
    address = getattr(getattr(client, "scheduler", None), "address", "")
    return ClusterError(
        f"the scheduler {address} is gone: start it and then the same command again; what is done stays"
    )


def _put_in(args: tuple[Any, ...], done: Mapping[str, Any], other: Callable[[Any], Any]) -> list[Any]:
    """Return arguments with what the `Result`s among them stand for."""

    def one(value: Any) -> Any:
        if isinstance(value, Result):
            return done[value.key]
        return [one(each) for each in value] if type(value) is list else other(value)

    return [one(value) for value in args]


def _computed(value: Any) -> Any:
    """Return an array of Dask computed, all else as it is."""
    return value.compute(scheduler="synchronous") if hasattr(value, "__dask_graph__") else value

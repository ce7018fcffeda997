"""Where steps run: on a client that is there, on workers that are started here, or in this process."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import numpy as np

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.errors import InputError
from imgquad_core.jit import share_on_disk

from .graph import ClusterError, Step, Told, run_here, run_on

REACHED = 20  #: seconds in which a scheduler must answer
#: bytes that glibc keeps, and from which a block gets pages of its own. With the 64 kB that Dask sets, workers give all
#: arrays back at once, and pages that come again took a sixth of the CPU seconds
MALLOC = {"MALLOC_TRIM_THRESHOLD_": 256 << 20, "MALLOC_MMAP_THRESHOLD_": 32 << 20}


@contextmanager
def opened(workers: int, scheduler: str | None, client: Any) -> Iterator[Any]:
    """Give the client that is given, that of a scheduler, or of so many workers here; None for one: this process.

    Raises
    ------
    InputError
        Dask is not installed, or there is no scheduler at the address.
    """
    if client is not None or (scheduler is None and workers <= 1):
        yield client
        return
    if find_spec("distributed") is None:
        raise InputError("more than one worker needs Dask: pip install dask distributed (or imgquad-mesh[dask])")
    from distributed import Client, LocalCluster  # an extra

    if scheduler is not None:
        with _reached(scheduler) as reached:
            yield reached
        return
    warm_up()
    dashboard = ":0" if find_spec("bokeh") else None
    options = {"threads_per_worker": 1, "dashboard_address": dashboard, "silence_logs": 50}
    with _keeping_memory(), LocalCluster(n_workers=workers, **options) as cluster, Client(cluster) as started:
        yield started


def _keeping_memory() -> Any:
    """Have workers that are started meanwhile keep some memory for later."""
    import dask  # an extra

    name = "distributed.nanny.pre-spawn-environ"
    return dask.config.set({name: {**dask.config.get(name, {}), **MALLOC}})


def _reached(address: str) -> Any:
    from distributed import Client  # an extra

    try:
        return Client(address, timeout=REACHED, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"no scheduler answers at {address}: start one (dask scheduler), or give --workers"
        ) from error


def warm_up() -> None:
    """Compile the kernels in this process, if that was never done: else each worker would."""
    if share_on_disk() < 0.9:
        labels = np.add.outer(np.arange(48) // 24, np.arange(48) // 24)
        mesh_image(labels, MeshOptions(size=3.0))


def run_steps(steps: Iterable[Step], client: Any, told: Told) -> dict[str, Any]:
    """Run steps on a client, the current one if None is given; in this process if there is none."""
    client = client or _current()
    return run_here(steps, told) if client is None else run_on(client, steps, told)


def _current() -> Any:
    """Return the client of Dask that is current here, None if there is none."""
    if "distributed" not in sys.modules:  # nobody has made one; to load it takes longer than many a picture
        return None
    from distributed import default_client  # an extra

    try:
        return default_client()
    except ValueError:
        return None

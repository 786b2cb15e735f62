"""Do the same with many recordings: on the cores of this machine, or on an existing Dask cluster.

The results are the same in both cases, and in the order of the given recordings.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any, TypeVar

from shift_schemas.errors import InvalidSettings, Unavailable

Item = TypeVar("Item")
Result = TypeVar("Result")

EXTRA = "--scheduler needs Dask: install it with pip install 'shift-mesh[cluster]'"
CONNECT_WITHIN_S = 10


def for_each(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int = 0, scheduler: str = ""
) -> Iterator[Result]:
    """Yield ``function(item)`` for each item, in the order of the items.

    Parameters
    ----------
    function
        A function of a module, or a partial of one, so that it can be sent to another process.
    workers
        The number of processes; 0 stands for one for each core.
    scheduler
        The address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``. Its workers must see the same files.

    Raises
    ------
    InvalidSettings
        A scheduler is given and Dask is not installed.
    Unavailable
        The scheduler does not answer.
    """
    if scheduler:
        yield from _on_cluster(function, items, scheduler)
        return
    count = min(workers or os.cpu_count() or 1, len(items))
    if count <= 1:
        yield from map(function, items)
        return
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=spawn) as pool:
        yield from pool.map(function, items)


def _on_cluster(function: Callable[[Any], Any], items: Sequence[Any], scheduler: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    try:
        client = Client(scheduler, timeout=CONNECT_WITHIN_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as e:
        why = f"the Dask scheduler {scheduler} does not answer ({e}); start it, or leave --scheduler out"
        raise Unavailable(why) from e
    with client:
        futures = client.map(function, items, pure=False)
        for future in futures:
            yield future.result()

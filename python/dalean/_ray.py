"""Runs of a sweep as tasks of Ray (``pip install "dalean[ray]"``): one task a run, all in one store.

A run is taken by locking its folder, and keeps a checkpoint after every epoch. A worker that ends in the middle leaves its lock; Ray
gives the task to another, which goes on from that checkpoint. What is finished is never done again, so nothing is there twice.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from . import _dalean
from .errors import RunError

if TYPE_CHECKING:
    from ._progress import Progress


def one(
    file: Path,
    text: str | None,
    settings: list[str],
    store: Path,
    data: Path,
    kernel: str | None,
    keep_states: bool,
    shard: str,
) -> list[int]:
    """Does the runs of a shard in a worker: how many there are, are finished, failed."""
    if not store.is_dir():
        found, allowed = "is no folder on a machine that Ray works on", "give a store that all of them reach by this path"
        raise RunError(f"{store} {found}; {allowed}", str(store), found, allowed)
    with tempfile.TemporaryDirectory(prefix="dalean") as folder:
        if text is not None:
            file = Path(folder) / file.name
            file.write_text(text, encoding="utf-8")
        return _dalean.sweep_part(file, settings, store, data, kernel, keep_states, False, shard)


def share(
    address: str | bool,
    file: Path,
    text: str | None,
    settings: list[str],
    store: Path,
    data: Path,
    kernel: str | None,
    keep_states: bool,
    replace: bool,
    told: Progress,
) -> None:
    """Carries out all runs of a sweep. Raises what a worker raised; a run that failed is none of that: its row says so."""
    import ray

    runs = _dalean.sweep_runs(file, settings, data)
    # a shard without runs: plans the sweep in the store, for all
    _dalean.sweep_part(file, settings, store, data, kernel, keep_states, replace, f"{runs + 1}/{runs + 1}")
    mine = not ray.is_initialized()
    if mine:
        ray.init(address=address if isinstance(address, str) else None, include_dashboard=False, log_to_driver=False)
    try:
        # a worker that ends is no fault of its run
        task = ray.remote(num_cpus=1, max_retries=-1)(one)
        name = file if text is None else Path(file.name)
        shards = [f"{at}/{runs}" for at in range(1, runs + 1)]
        left = [task.remote(name, text, settings, store, data, kernel, keep_states, shard) for shard in shards]
        try:
            while left:
                ended, left = ray.wait(left, timeout=0.2)
                ray.get(ended)
                finished = runs - len(left)
                told("sweep", {"finished": finished, "failed": 0, "runs": runs, "share": finished / max(runs, 1)})
        except BaseException:
            for rest in left:
                ray.cancel(rest)
            raise
    finally:
        if mine:
            ray.shutdown()

"""Runs and sweeps, as the command line has them."""

from __future__ import annotations

import html
import json
import os
import tempfile
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _dalean
from ._progress import Progress
from ._text import Overrides, Spans, asked, below_hw, place, settings, source, text, threads as _threads
from .errors import RunError
from .tables import Chips, Table

PathLike = str | os.PathLike

__all__ = ["Report", "Run", "Verdict", "configuration", "resume", "sweep", "train"]


def configuration(
    config: PathLike | Overrides | None = None,
    overrides: Overrides | None = None,
    *,
    hw: str | None = None,
    seed: int | None = None,
) -> str:
    """The resolved configuration as TOML: what ``config`` says, ``overrides`` over it, and every default.

    Raises :class:`dalean.ConfigError` with key, value and what is allowed.
    """
    return _dalean.configuration(source(config), hw, settings(overrides), seed)


def train(
    config: PathLike | Overrides | None = None,
    overrides: Overrides | None = None,
    out: PathLike | None = None,
    *,
    hw: str | None = None,
    seed: int | None = None,
    data: PathLike | None = None,
    threads: int | None = None,
    kernel: str | None = None,
    record: bool = False,
    progress: bool | None = None,
) -> Run:
    """Trains an experiment in a new folder, as ``dalean train`` does: the same bits, whatever threads and kernel.

    :param config: an experiment file, or a dict of its keys; without it, the built-in digits.
    :param overrides: keys that win over the file: ``{"hw.cell.level_bits": 4}``; ``None`` takes a key back.
    :param out: folder that gets the run's folder; else ``DALEAN_RUNS``, else ``runs``.
    :param hw: hardware model, a built-in name or a file.
    :param data: folder of data sets; else ``DALEAN_DATA``, else ``data``.
    :param record: keeps what the environments of a policy show, so that it can be verified without them.
    :raises dalean.ConfigError: when a key or a value cannot be.
    :raises KeyboardInterrupt: after the batch in progress; :func:`resume` goes on from the last finished epoch.
    """
    with Progress(progress) as told:
        path, _ = _dalean.train(
            source(config),
            hw,
            settings(overrides),
            seed,
            place(out, "DALEAN_RUNS", "runs"),
            place(data, "DALEAN_DATA", "data"),
            _threads(threads),
            kernel,
            record,
            told if told.show else None,
        )
    return Run(path)


def resume(
    path: PathLike,
    *,
    data: PathLike | None = None,
    files: PathLike | None = None,
    threads: int | None = None,
    kernel: str | None = None,
    progress: bool | None = None,
) -> Run:
    """Continues a run from its last finished epoch, and gives the bits of never having stopped.

    :param files: where data files of one's own are now, if they were moved.
    """
    with Progress(progress) as told:
        path, _ = _dalean.resume(
            Path(path),
            place(data, "DALEAN_DATA", "data"),
            None if files is None else Path(files),
            _threads(threads),
            kernel,
            told if told.show else None,
        )
    return Run(path)


@dataclass(frozen=True)
class Verdict:
    """What doing a run again showed; true when every number compared is equal."""

    same: bool
    epochs: int | None = None
    """Epochs compared, epoch 0 included."""
    state_hash: str | None = None
    """Hash of the last state compared."""
    test: bool | None = None
    """Whether the final test was compared."""
    unchecked: list[str] | None = None
    """Files, or parts of them, that were not compared."""
    what: str | None = None
    """What differs: file, epoch, field."""
    wanted: str | None = None
    """What the run says."""
    found: str | None = None
    """What came out."""

    def __bool__(self) -> bool:
        return self.same


class Report:
    """The page of a run. Jupyter shows it inline."""

    def __init__(self, path: Path, summary: str) -> None:
        self.path, self.summary = path, summary

    @property
    def html(self) -> str:
        """The page: one file without external resources."""
        return self.path.read_text(encoding="utf-8")

    def __str__(self) -> str:
        return self.summary

    def __repr__(self) -> str:
        return f"Report({str(self.path)!r})"

    def _repr_html_(self) -> str:
        page = html.escape(self.html, quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:640px;border:0"></iframe>'


class Run:
    """A run in its folder: resolved configuration, one record an epoch, ledger, checkpoints, receipt, page."""

    def __init__(self, path: PathLike) -> None:
        self.path = Path(path)
        if not (self.path / "config.toml").is_file():
            found, allowed = "is no folder of a run", "name one that has a config.toml and a receipt.json"
            raise RunError(f"{self.path} {found}; {allowed}", str(self.path), found, allowed)

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

    def _json(self, name: str) -> Any:
        try:
            return json.loads((self.path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            found, allowed = f"cannot be read: {error}", "a run has it when it is finished"
            raise RunError(f"{self.path / name} {found}; {allowed}", str(self.path / name), found, allowed) from error

    @property
    def config(self) -> str:
        """The resolved configuration, as TOML."""
        return (self.path / "config.toml").read_text(encoding="utf-8")

    @property
    def receipt(self) -> dict[str, Any]:
        """Hashes of everything that decides the run and of everything that came out."""
        return self._json("receipt.json")

    @property
    def ledger(self) -> dict[str, Any]:
        """Every count by phase, layer, pathway, operation and event; cycles by phase."""
        return self._json("ledger.json")

    @property
    def metrics(self) -> list[dict[str, Any]]:
        """One record an epoch, epoch 0 the state before the first update: scores, levels, events, cycles, state hash."""
        lines = (self.path / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
        return [json.loads(line) for line in lines]

    @property
    def state_hash(self) -> str:
        """BLAKE3 of state and counters after the last finished epoch: the same on every machine."""
        return self.metrics[-1]["state_hash"]

    @property
    def test(self) -> dict[str, Any] | None:
        """The final test, which reads the test set once."""
        return self.receipt.get("test")

    @property
    def accuracy(self) -> float | None:
        """Right answers of the final test, as a fraction; ``None`` of a policy."""
        score = (self.test or {}).get("score")
        return score["correct"] / score["total"] if score else None

    def levels(self) -> dict[str, Any]:
        """Levels of every array after the last epoch, ``{"layer0.pp": uint16 [row, column]}``."""
        from .arrays import read_safetensors

        tensors = read_safetensors(self.path / "checkpoint.safetensors")
        ending = ".levels"
        return {name[: -len(ending)]: array for name, array in tensors.items() if name.endswith(ending)}

    def verify(
        self,
        *,
        epochs: int | None = None,
        data: PathLike | None = None,
        files: PathLike | None = None,
        threads: int | None = None,
        kernel: str | None = None,
        progress: bool | None = None,
    ) -> Verdict:
        """Does the run again, or its first ``epochs`` epochs, and compares every number of its folder."""
        with Progress(progress) as told:
            verdict = _dalean.verify(
                self.path,
                place(data, "DALEAN_DATA", "data"),
                None if files is None else Path(files),
                _threads(threads),
                kernel,
                epochs,
                told if told.show else None,
            )
        return Verdict(**verdict)

    def evaluate(
        self,
        *,
        data: PathLike | None = None,
        files: PathLike | None = None,
        threads: int | None = None,
        kernel: str | None = None,
    ) -> float | None:
        """Reads the test set with the run's state: right answers as a fraction; ``None`` of a policy."""
        score, _ = _dalean.evaluate(
            self.path,
            place(data, "DALEAN_DATA", "data"),
            None if files is None else Path(files),
            _threads(threads),
            kernel,
        )
        return None if score is None else score[0] / score[1]

    def on_chips(
        self,
        *,
        samples: int | None = None,
        chip: int | None = None,
        after: Spans | None = None,
        compensate: bool = False,
        hw: str | os.PathLike | None = None,
        overrides: Overrides | None = None,
        data: PathLike | None = None,
        files: PathLike | None = None,
        threads: int | None = None,
        kernel: str | None = None,
        progress: bool | None = None,
    ) -> Chips:
        """Loads what the run learnt into other chips of its kind, lets it drift and reads the test set, as ``dalean eval`` does with
        ``--samples``, ``--chip``, ``--after``, ``--compensate``, ``--hw`` and ``--set``: the same numbers.

        One row a chip and a moment, with the accuracy as a fraction (``test_accuracy``) or the mean return (``return_mean``)::

            chips = run.on_chips(samples=1000, after=["1d", "1y"], compensate=True, hw="hw_models/own/pcm_drift.toml")
            chips.summary[1]["worst_chip"], chips.to_pandas().groupby("after_s").test_accuracy.quantile(0.05)

        :param samples: chips 1 to ``samples``; the number decides stuck cells, windows, what loads leave, drift and noise.
        :param chip: one chip, by its number; 0, the default, is the one that learnt.
        :param after: seconds after programming, or spans such as ``"1d"`` (s, min, h, d, y); one or several. Without it, at once.
        :param compensate: whether a factor a layer makes up for drift.
        :param hw: a hardware model whose ``[device]`` the chips have; a table in it that only pulses have to do with is warned of.
        :param overrides: keys of ``hw.device``, such as ``{"hw.device.faults.stuck_any": 0.01}``; the prefix ``hw.`` may be left out.
        :raises dalean.ConfigError: when nothing of what is asked for varies, or a value cannot be.
        :raises KeyboardInterrupt: after the chip in progress.
        """
        chips, seconds = asked(samples, chip, after)
        with Progress(progress, "readings") as told:
            rows, unread = _dalean.chips(
                self.path,
                place(data, "DALEAN_DATA", "data"),
                None if files is None else Path(files),
                _threads(threads),
                kernel,
                chips,
                seconds,
                compensate,
                None if hw is None else os.fspath(hw),
                below_hw(overrides),
                told if told.show else None,
            )
        if unread:
            warnings.warn(unread, stacklevel=2)
        policy = (self.test or {}).get("task") == "policy"
        return Chips("return_mean" if policy else "test_accuracy", rows)

    def report(self, *, data: PathLike | None = None, files: PathLike | None = None) -> Report:
        """Draws the page of the run again."""
        path, summary = _dalean.report(
            self.path, place(data, "DALEAN_DATA", "data"), None if files is None else Path(files)
        )
        return Report(Path(path), summary)

    def price(self, hw: str | None = None) -> dict[str, Any]:
        """What the run cost on its chip, or with the constants of another: joules and seconds, as ``dalean price --json``."""
        return json.loads(_dalean.price(self.path, hw))

    def _repr_html_(self) -> str:
        page = self.path / "report.html"
        return Report(page, "")._repr_html_() if page.exists() else html.escape(repr(self))


def sweep(
    file: PathLike | Overrides,
    overrides: Overrides | None = None,
    store: PathLike | None = None,
    *,
    name: str | None = None,
    data: PathLike | None = None,
    jobs: int | None = None,
    kernel: str | None = None,
    keep_states: bool = False,
    replace: bool = False,
    ray: bool | str = False,
    progress: bool | None = None,
) -> Table:
    """Carries out a sweep in a store, as ``dalean sweep`` does, and gives its table: one row a point.

    Finished runs are never run again, whoever did them; an interrupted sweep goes on where it was.

    :param file: a sweep file, or a dict of its keys: ``{"base": {...}, "axis": [{"name": .., "key": .., "values": [..]}]}``.
    :param overrides: keys of all points; axes win.
    :param store: folder of all runs; else ``DALEAN_STORE``, else ``store``.
    :param name: what the sweep of a dict is called in the store.
    :param jobs: runs at a time, on one thread each.
    :param ray: whether runs are tasks of Ray, on one thread each and as many at a time as it has processors; or its address. Store and
        data are folders that all its machines reach by the same path. The rows are those of a sweep without it.
    """
    with Progress(progress, "share") as told, tempfile.TemporaryDirectory(prefix="dalean") as folder:
        written = None
        if isinstance(file, Mapping):
            path, written = Path(folder) / f"{name or 'sweep'}.toml", _sweep_text(file)
            path.write_text(written, encoding="utf-8")
        else:
            path = Path(file)
        if ray:
            from ._ray import share

            here, there = place(store, "DALEAN_STORE", "store").absolute(), place(data, "DALEAN_DATA", "data").absolute()
            share(ray, path.absolute(), written, settings(overrides), here, there, kernel, keep_states, replace, told)
        swept = _dalean.sweep(
            path,
            settings(overrides),
            place(store, "DALEAN_STORE", "store"),
            place(data, "DALEAN_DATA", "data"),
            _threads(jobs),
            kernel,
            keep_states,
            replace,
            told if told.show else None,
        )
    return Table(*swept)


def _sweep_text(keys: Overrides) -> str:
    """A dict of a sweep as its file; the experiment it names is relative to the working directory."""
    keys = dict(keys)
    if isinstance(keys.get("experiment"), str | os.PathLike):
        keys["experiment"] = str(Path(keys["experiment"]).absolute())
    return text(keys)

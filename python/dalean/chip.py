"""The chip itself: the five operations, their ledger and cycles, levels as arrays.

::

    chip = dalean.Chip("reram", {"hw.cell.level_bits": 5})
    net = dalean.Network([64, 32, 10], chip, overrides={"learning.batch": 16})
    activities = net.read(x)                    # LOADX, FWD
    net.deliver(net.error_words(255 * onehot - activities.astype(int)))     # ERR
    net.write()                                 # UPD

A caller decides which codes arrive, what the errors are and when cells are written; the same integer engine does the rest as
for a task of the program, bit by bit.
"""

from __future__ import annotations

import hashlib
import json
import operator
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _dalean
from ._progress import Progress
from ._text import Overrides, Spans, asked, below_hw, settings, taps, text
from .arrays import read_safetensors
from .errors import ArrayError, ChipError
from .tables import Chips

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Chip", "Network"]


class Chip:
    """A substrate: a hardware model and what is changed of it.

    :param hw: a built-in name (``ideal``, ``reram``, ``prime``, ...) or a file.
    :param overrides: keys below ``hw.``, such as ``{"hw.cell.level_bits": 4}``; the prefix may be left out.
    :raises dalean.ConfigError: when there is no such model, or a value cannot be.
    """

    def __init__(self, hw: str | os.PathLike = "ideal", overrides: Overrides | None = None) -> None:
        self.hw = os.fspath(hw)
        self.settings = below_hw(overrides)
        self.config = _dalean.configuration(None, self.hw, self.settings, None)
        """The resolved configuration of the built-in digits on this chip, as TOML; the chip is ``[hw]``."""

    def __repr__(self) -> str:
        return f"Chip({self.hw!r}, {self.settings!r})"


class Network(_dalean.Network):
    """A dense network on a chip, driven from outside.

    :param sizes: inputs, units of each hidden layer, outputs: ``[64, 32, 10]``.
    :param chip: the chip, or the name of one.
    :param rule: how arrays are wired: ``"ed"`` two populations under Dale's law, ``"dfa"`` and ``"bp"`` differential pairs.
    :param words: ``"routed"``: hidden layers hear the words of the output by the network's route; ``"own"``: whoever
        drives the network delivers words to each layer.
    :param signed: whether what is shown has a sign, floats from -1 to 1 or whole numbers up to ``code_max``: rows are driven with what
        lies above 0, then with what lies below.
    :param updates: updates of the whole training, over which rates fall where ``learning.decay`` says so.
    :param seed: seed of all draws.
    :param overrides: keys of ``network`` and ``learning``: ``{"network.alpha": 4, "learning.rate": 20}``.
    :param threads: threads that share large operations; no bit depends on it. A fork takes them away, and a child makes its own.
    :raises dalean.ConfigError: when something does not fit together, or not on the chip.
    """

    sizes: list[int]
    deployment: Any = None
    """How the layers of a network came onto the chip that :func:`dalean.deploy` made."""

    def __new__(
        cls,
        sizes: Sequence[int],
        chip: Chip | str | None = None,
        *,
        rule: str = "ed",
        words: str = "routed",
        signed: bool = False,
        updates: int = 1,
        seed: int = 1,
        overrides: Overrides | None = None,
        threads: int = 1,
        kernel: str | None = None,
    ) -> Network:
        chip = chip if isinstance(chip, Chip) else Chip(chip or "ideal")
        try:
            sizes = [operator.index(size) for size in sizes]
        except TypeError:
            raise _wrong("sizes", f"is {sizes!r}", "give whole numbers, such as [64, 32, 10]") from None
        if len(sizes) < 2 or min(sizes) < 1:
            raise _wrong("sizes", f"is {sizes}", "give inputs, units of hidden layers and outputs, each at least 1")
        if words not in ("routed", "own"):
            raise _wrong("words", f"is {words!r}", 'it is "routed" or "own"')
        keys = {"network.hidden": sizes[1:-1], "learning.rule": rule, **taps(rule, sizes[-1], overrides)}
        if sizes[-1] == 1:
            keys["network.outputs"] = 1
        made = super().__new__(
            cls,
            "network",
            text(keys),
            chip.hw,
            [*chip.settings, *settings(overrides)],
            seed,
            sizes[0],
            sizes[-1],
            bool(signed),
            words == "own",
            updates,
            threads,
            kernel,
        )
        made.sizes = sizes
        return made

    @property
    def state_hash(self) -> str:
        """BLAKE3 of levels and counters. What was read is forgotten."""
        return super().state_hash()

    @property
    def ledger(self) -> list[dict[str, Any]]:
        """What was counted: phase, layer, pathway, operation, event, count; zeros are left out."""
        return json.loads(super().ledger_json())["counts"]

    @property
    def cycles(self) -> dict[str, Any] | None:
        """Cycles by phase; ``None`` on a chip without a timing."""
        return json.loads(super().ledger_json())["cycles"]

    def count(self, event: str, phase: str = "training") -> int:
        """How often something happened: ``net.count("pulses_attempted")``."""
        return sum(one["count"] for one in self.ledger if one["event"] == event and one["phase"] == phase)

    def write(self, shift: int | Sequence[int | None] | None = None) -> None:
        """``UPD``: writes every layer that heard words, and ends the update.

        :param shift: bits that are rounded off the sums, of all layers or one a layer; one less writes twice as much.
            Without it, that of the network's rate.
        :raises dalean.ChipError: when nothing was delivered since the last read.
        """
        if shift is None:
            super().write()
        elif isinstance(shift, Sequence):
            super().write(list(shift))
        else:
            super().write([int(shift)] * self.layers)

    def all_levels(self) -> dict[str, NDArray[np.uint16]]:
        """Levels of every array, ``{"layer0.pp": [row, column]}``."""
        layers = range(self.layers)
        return {f"layer{at}.{name}": self.levels(at, name) for at in layers for name in self.pathways(at)}

    def load_all(self, levels: dict[str, ArrayLike]) -> None:
        """``LOADW``: loads levels by name, as :meth:`all_levels` gives them; arrays that are not named stay."""
        for name, array in levels.items():
            layer, _, pathway = name.removeprefix("layer").partition(".")
            if not layer.isdigit():
                raise _wrong("levels", f"name {name!r}", 'names are such as "layer0.pp"')
            self.load(int(layer), pathway, array)

    def on_chips(
        self,
        score: Callable[[Network], float],
        *,
        samples: int | None = None,
        chip: int | None = None,
        after: Spans | None = None,
        compensate: bool = False,
        progress: bool | None = None,
    ) -> Chips:
        """Loads the network into other chips of its kind, lets it drift, and asks ``score`` what it is worth there: one row a chip
        and a moment, with the column ``score``::

            net = dalean.deploy(module, x, dalean.Chip("hw_models/own/pcm_drift.toml", {"device.faults.stuck_any": 0.01}))
            right = lambda net: (net.read(test, learn=False).argmax(1) == labels).mean()
            net.on_chips(right, samples=1000, after=["1d", "1y"], compensate=True).summary

        Chips have the ``[device]`` of the network's. Into one of a number above 0 every array is loaded: what was last loaded into
        it here or, where cells were written since, what it holds. Each begins with the counters, ranges of converters and
        thresholds that the network has now, and afterwards the network is as it was.

        :param score: is given the network, on the chip; reads it and gives a number, the more the better.
        :param samples: chips 1 to ``samples``; the number decides stuck cells, windows, what loads leave, drift and noise.
        :param chip: one chip, by its number; 0, the default, is the one that it is on.
        :param after: seconds after programming, or spans such as ``"1d"`` (s, min, h, d, y); one or several. Without it, at once.
        :param compensate: whether a factor a layer makes up for drift.
        :raises dalean.ConfigError: when nothing of what is asked for varies on this chip, or a value cannot be.
        """
        chips, seconds = asked(samples, chip, after)
        moments = super().leave(chips, seconds, compensate)
        rows: list[tuple[int, float | None, float]] = []
        try:
            with Progress(progress, "readings") as told:
                for number in chips:
                    for at, after_s in enumerate(moments):
                        super().onto(number, at)
                        worth = score(self)
                        try:
                            rows.append((number, after_s, float(worth)))
                        except (TypeError, ValueError):
                            raise _wrong("score", f"gives {worth!r}", "it gives a number") from None
                        told("chips", {"done": len(rows), "total": len(chips) * len(moments)})
        finally:
            super().home()
        return Chips("score", rows)

    def save(self, path: str | os.PathLike) -> Path:
        """Writes levels as NPZ where the name ends with it, else the whole state as safetensors."""
        path = Path(path)
        if path.suffix == ".npz":
            np.savez(path, **self.all_levels())
        else:
            path.write_bytes(self.checkpoint())
        return path

    def restore(self, source: str | os.PathLike | bytes) -> None:
        """Puts a state back that :meth:`save` or :meth:`checkpoint` gave; of an NPZ or of another network's state, the levels.

        :raises dalean.CheckpointError: when it is damaged.
        """
        if not isinstance(source, bytes):
            if Path(source).suffix == ".npz":
                with np.load(source, allow_pickle=False) as arrays:
                    return self.load_all(dict(arrays))
            source = Path(source).read_bytes()
        self.put_back(source)

    def restore_levels(self, source: str | os.PathLike | bytes) -> None:
        """Loads the levels of any checkpoint with arrays of this size, that of a run for one."""
        ending = ".levels"
        tensors = read_safetensors(source).items()
        self.load_all({name[: -len(ending)]: array for name, array in tensors if name.endswith(ending)})

    def receipt(self, **told: Any) -> dict[str, Any]:
        """What lets anyone check that doing it again gives the same: hashes of the network, of everything that was driven,
        delivered, written and loaded, of the ledger and of the state.

        ``told`` is kept beside it, such as ``script=__file__``, whose content is hashed.
        """
        said = {}
        for key, value in told.items():
            path = Path(value) if isinstance(value, str | os.PathLike) else None
            if path is not None and path.is_file():
                value = {"name": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
            said[key] = value
        ledger = super().ledger_json()
        return {
            "arithmetic": _dalean.ARITHMETIC,
            "version": _dalean.VERSION,
            "network": self.key,
            "seed": self.seed,
            "updates": self.updates,
            "driven": self.told_hash(),
            "ledger_sha256": hashlib.sha256(ledger.encode()).hexdigest(),
            "state_hash": self.state_hash,
            **said,
        }

    def __reduce__(self) -> tuple:
        found, allowed = "is not pickled", "keep its checkpoint(), and put it back into a network that is made alike"
        raise ChipError(f"a network {found}; {allowed}", "a network", found, allowed)


def _wrong(where: str, found: str, allowed: str) -> ArrayError:
    return ArrayError(f"{where} {found}; {allowed}", where, found, allowed)

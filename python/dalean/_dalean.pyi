"""The part in Rust. Users call :mod:`dalean`, which gives names and defaults to all of this."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

ARITHMETIC: int
VERSION: str

_Text = tuple[str, str] | None
_Told = Callable[[str, Any], None] | None

def main(arguments: list[str]) -> int: ...
def configuration(text: _Text, hw: str | None, settings: list[str], seed: int | None) -> str: ...
def train(
    text: _Text,
    hw: str | None,
    settings: list[str],
    seed: int | None,
    out: PathLike[str],
    data: PathLike[str],
    threads: int,
    kernel: str | None,
    record: bool,
    callback: _Told,
) -> tuple[str, str]: ...
def resume(
    path: PathLike[str],
    data: PathLike[str],
    moved: PathLike[str] | None,
    threads: int,
    kernel: str | None,
    callback: _Told,
) -> tuple[str, str]: ...
def verify(
    path: PathLike[str],
    data: PathLike[str],
    moved: PathLike[str] | None,
    threads: int,
    kernel: str | None,
    epochs: int | None,
    callback: _Told,
) -> dict[str, Any]: ...
def evaluate(
    path: PathLike[str], data: PathLike[str], moved: PathLike[str] | None, threads: int, kernel: str | None
) -> tuple[tuple[int, int] | None, str]: ...
def chips(
    path: PathLike[str],
    data: PathLike[str],
    moved: PathLike[str] | None,
    threads: int,
    kernel: str | None,
    chips: list[int],
    after: list[float],
    compensate: bool,
    hw: str | None,
    settings: list[str],
    callback: _Told,
) -> tuple[list[tuple[int, float | None, float]], str | None]: ...
def chip_summaries(
    rows: Sequence[tuple[int, float | None, float]],
) -> list[tuple[float | None, int, float, float | None, list[float], float, float, int]]: ...
def seconds(span: str) -> float | None: ...
def price(path: PathLike[str], hw: str | None) -> str: ...
def report(path: PathLike[str], data: PathLike[str], moved: PathLike[str] | None) -> tuple[str, str]: ...
def sweep(
    file: PathLike[str],
    settings: list[str],
    store: PathLike[str],
    data: PathLike[str],
    jobs: int,
    kernel: str | None,
    keep_states: bool,
    replace: bool,
    callback: _Told,
) -> tuple[str, list[tuple[str, str, str, list[Any]]], str, list[int], bytes]: ...
def sweep_runs(file: PathLike[str], settings: list[str], data: PathLike[str]) -> int: ...
def sweep_part(
    file: PathLike[str],
    settings: list[str],
    store: PathLike[str],
    data: PathLike[str],
    kernel: str | None,
    keep_states: bool,
    replace: bool,
    shard: str,
) -> list[int]: ...

class Network:
    """A dense network whose every operation is the caller's; see :class:`dalean.Network`."""

    config: str
    """The resolved configuration, as TOML."""
    key: str
    """What checkpoints of it belong to."""
    layers: int
    code_max: int
    """Greatest drive code of an input."""
    word_max: int
    """Greatest error word; the least is its negative."""
    level_bits: int
    """Bits of a stored level."""
    window: tuple[int, int]
    """Least and greatest level of a cell."""
    signed: bool
    """Whether what is shown has a sign."""
    updates: int
    samples: int
    """Samples loaded."""
    seed: int
    def size(self, layer: int) -> tuple[int, int]:
        """Inputs and units of a layer."""
    def pathways(self, layer: int) -> list[str]:
        """Names of its arrays, such as ``pp``: source, then target."""
    def shift(self, layer: int) -> int:
        """Bits that the next write rounds off its sums."""
    def read(self, x: ArrayLike, learn: bool = True) -> NDArray[np.uint8] | NDArray[np.int64]:
        """``LOADX`` and ``FWD``: reads ``x`` ``[sample, input]`` through all layers.

        ``uint8`` are drive codes up to ``code_max``; floats from 0 to 1 become the nearest one; with a sign, from -1 to 1, where the
        network was made so. Gives activities of the
        outputs, ``[sample, output]``, 255 is 1.0; accumulators (``int64``) of outputs without a table. What is read with
        ``learn=False`` is charged to evaluation and cannot be learnt from.

        Raises :class:`dalean.ArrayError` or :class:`dalean.ChipError`; nothing has moved then.
        """
    def calibrate(self, x: ArrayLike) -> None:
        """Finds ranges of finite converters from up to 256 samples."""
    def codes(self, layer: int, stream: Literal["p", "n"] = "p") -> NDArray[np.uint8]:
        """What units put out, ``[sample, unit]``: drive codes of the layer above, activities of the last."""
    def slopes(self, layer: int, stream: Literal["p", "n"] = "p") -> NDArray[np.uint8]:
        """Derivatives, ``[sample, unit]``; 255 at the peak."""
    def gates(self, layer: int, stream: Literal["p", "n"] = "p") -> NDArray[np.int8]:
        """Word times derivative, ``[sample, unit]``: what an update multiplies drives by."""
    def accumulators(self, stream: Literal["p", "n"] = "p") -> NDArray[np.int64]:
        """Sums of the last layer, ``[sample, unit]``."""
    def error_words(self, errors: ArrayLike) -> NDArray[np.int16]:
        """Output words of errors ``[sample, output]`` (255: should be 1, is 0) by the chip's error unit."""
    def deliver(self, words: ArrayLike, layer: int | None = None) -> None:
        """``ERR``: output words ``[sample, output]`` to all layers by rule and route; or words of its own
        ``[sample, unit]`` to a layer, of a network made with ``words="own"``. A positive word asks for more; stream n
        hears the negative."""
    def read_back(self, layer: int) -> NDArray[np.int64]:
        """``FWD(columns)``: sums of the rows of a layer of differential pairs, driven with its gates, ``[sample, input]``."""
    def write(self, shifts: Sequence[int | None] = ...) -> None:
        """``UPD`` of every layer that heard words."""
    def levels(self, layer: int, pathway: str) -> NDArray[np.uint16]:
        """Levels of an array, ``[row, column]``; a constant row is the last."""
    def load(self, layer: int, pathway: str, levels: ArrayLike) -> None:
        """``LOADW``: loads levels into an array, ``[row, column]``."""
    def leave(self, chips: Sequence[int], after: Sequence[float], compensate: bool) -> list[float | None]:
        """Gets ready for other chips, and gives the moments at which each is read: seconds after programming."""
    def onto(self, number: int, moment: int) -> None:
        """Goes to a chip at a moment."""
    def home(self) -> None:
        """Comes back, as it was."""
    def ledger_json(self) -> str: ...
    def told_hash(self) -> str:
        """BLAKE3 of everything that came from outside, in order."""
    def checkpoint(self) -> bytes:
        """The state as safetensors. What was read is forgotten."""
    def put_back(self, bytes: bytes) -> None:
        """Puts back what :meth:`checkpoint` gave."""

class Classifier:
    """See :class:`dalean.EDClassifier`."""

    config: str
    epoch: int
    epochs: int
    def __new__(
        cls,
        name: str,
        text: str,
        hw: str | None,
        settings: list[str],
        seed: int | None,
        features: int,
        classes: int,
        x: ArrayLike | None,
        y: ArrayLike | None,
        threads: int,
        kernel: str | None,
    ) -> Classifier: ...
    def learn(self, callback: _Told = None) -> int: ...
    def outputs(self, x: ArrayLike) -> NDArray[np.int64]: ...
    def state_hash(self) -> str: ...
    def checkpoint(self) -> bytes: ...
    def put_back(self, bytes: bytes) -> None: ...

class PolicyLearner:
    """See :class:`dalean.EDPolicy`."""

    config: str
    count: int
    epoch: int
    epochs: int
    steps: int
    def __new__(
        cls,
        name: str,
        text: str,
        hw: str | None,
        settings: list[str],
        seed: int | None,
        id: str,
        shown: int,
        active: int | None,
        discrete: bool,
        taken: int,
        steps_max: int,
        threads: int,
        kernel: str | None,
    ) -> PolicyLearner: ...
    def turn(self) -> tuple[str, NDArray[Any] | None]: ...
    def begin(self, shown: ArrayLike | tuple[ArrayLike, ArrayLike]) -> None: ...
    def take(
        self,
        next: ArrayLike | tuple[ArrayLike, ArrayLike],
        rewards: ArrayLike,
        terminated: ArrayLike,
        truncated: ArrayLike,
        reached: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
        idle: ArrayLike | None = None,
    ) -> None: ...
    def learn(self) -> dict[str, Any] | None: ...
    def answer(self, shown: ArrayLike | tuple[ArrayLike, ArrayLike], step: int) -> NDArray[Any]: ...
    def state_hash(self) -> str: ...
    def checkpoint(self) -> bytes: ...
    def put_back(self, bytes: bytes) -> None: ...

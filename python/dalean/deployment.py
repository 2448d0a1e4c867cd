"""Networks that were trained elsewhere, with weights of both signs, on a chip whose cells have none.

::

    net = dalean.deploy([(w1, b1), (w2, b2)], x, "reram")       # NumPy, [inputs, units]; or a PyTorch module, NPZ, safetensors
    net.read(test)                                              # through the chip's converters
    y = dalean.outputs(net)                                     # in the units that the weights came in
    net.deliver(net.error_words(255 * (wanted - softmax(y))))   # and trained on, in place
    net.write()
    net.on_chips(score, samples=1000, after="1d").summary       # and on others of its kind, later

``w = E - I`` of two cells, one of which rests on the floor::

    "pairs"   arrays e and i: one population; whoever trains on may give a weight the other sign
    "dual"    pp = nn = E, np = pn = I: two populations under Dale's law, alike in the beginning; error diffusion trains on

The levels of a layer are ``floor + round(|w| 2^level_bits / weight_max)``. A unit of the chip puts out 0 to 1, so the weights of
layers of ``relu`` are divided by what their units put out most, and multiplied by it in the layer above; a step of cells is a power
of two there. Sigmoids take any width (``network.alpha``) and outputs are sums, so their greatest weight is the greatest level.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._text import Overrides
from .arrays import read_safetensors
from .chip import Chip, Network
from .errors import ArrayError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Deployed", "deploy", "outputs", "signed"]

_Layer = tuple[np.ndarray, "np.ndarray | None"]
_PATHWAYS = {"pairs": (("e",), ("i",)), "dual": (("pp", "nn"), ("np", "pn"))}


@dataclass(frozen=True)
class Deployed:
    """How one layer came onto the chip."""

    weight_max: float
    """Weight of the level after the greatest."""
    factor: float
    """What the layer's weights were multiplied by."""
    scale: float
    """What its units put out, elsewhere, where they put out 1 on the chip."""
    alpha: float | None
    """Width of its sigmoid."""
    error_rms: float
    """Root mean square of what rounding changed, in levels."""
    beyond: float
    """Share of what its units put out, elsewhere and on the samples, that is more than the chip's 1."""


def deploy(
    layers: Any,
    x: ArrayLike,
    chip: Chip | str | None = None,
    *,
    to: str = "pairs",
    activation: str = "relu",
    rule: str | None = None,
    signed: bool = False,
    quantile: float = 0.999,
    updates: int = 1,
    seed: int = 1,
    overrides: Overrides | None = None,
    threads: int = 1,
    kernel: str | None = None,
) -> Network:
    """Maps a dense network of signed weights onto a chip, finds the ranges of its converters, and gives it to be read and trained on.

    :param layers: weights ``[inputs, units]`` of each layer, or pairs of them and biases; or arrays by name as PyTorch has them
        (``0.weight`` ``[units, inputs]``, ``0.bias``): a mapping, an NPZ or safetensors file, a module, whose order of layers is that
        of its state. Between the layers of a ``Sequential`` units are looked for; whatever else a module does in its ``forward`` is
        the caller's to know.
    :param x: samples that the network is used for, as :meth:`Network.read` takes them: what units put out is measured on them.
    :param to: ``"pairs"`` or ``"dual"``.
    :param activation: of hidden layers, ``"relu"`` or ``"sigmoid"``; outputs are sums, whose greatest is the answer.
    :param rule: how arrays learn afterwards: of pairs ``"dfa"`` (default) or ``"bp"``; of dual ones ``"ed"``.
    :param signed: whether ``x`` has a sign, as of :class:`Network`.
    :param quantile: share of what hidden units put out that lies within the chip's 0 to 1.
    :param overrides: keys of ``network`` and ``learning``, as of :class:`Network`.
    :raises dalean.ArrayError: when these are no layers of a network, or ``x`` does not fit them.

    ``net.deployment`` says of each layer what was done and what rounding cost.
    """
    if to not in _PATHWAYS:
        raise _wrong("to", f"is {to!r}", 'it is "pairs" or "dual"')
    if activation not in ("relu", "sigmoid"):
        raise _wrong("activation", f"is {activation!r}", 'it is "relu" or "sigmoid"')
    if not 0 < quantile <= 1:
        raise _wrong("quantile", f"is {quantile}", "it lies above 0 and is 1 at most")
    rule = rule or ("dfa" if to == "pairs" else "ed")
    if (rule in ("dfa", "bp")) != (to == "pairs"):
        raise _wrong("rule", f"is {rule!r}", 'pairs learn by "dfa" or "bp", dual arrays by "ed"')
    dense = _layers(layers, activation)
    sizes = [dense[0][0].shape[0], *(weights.shape[1] for weights, _ in dense)]
    biased = any(biases is not None for _, biases in dense)
    chip = chip if isinstance(chip, Chip) else Chip(chip or "ideal")
    probe = Network([1, 2], chip)
    floor, ceiling = probe.window
    steps, span = 2.0**probe.level_bits, ceiling - floor
    # one full level after the greatest is weight_max
    full = span / steps

    told, arrays = [], []
    active, before = _fractions(x, probe.code_max, sizes[0]), 1.0
    for at, (weights, biases) in enumerate(dense):
        last = at == len(dense) - 1
        rows = weights * before
        shifts = np.zeros(sizes[at + 1]) if biases is None else biases
        sums = active @ weights + shifts
        most = max(np.abs(rows).max(), np.abs(shifts).max()) or 1.0
        scale, beyond = 1.0, 0.0
        if activation == "relu" and not last:
            active = np.maximum(sums, 0)
            scale = float(np.quantile(active[active > 0], quantile)) if (active > 0).any() else 1.0
            beyond = float((active > scale).mean())
            factor, alpha = 1 / scale, None
            weight_max = 2.0 ** math.ceil(math.log2(most * factor / full))
        else:
            active = sums if last else 1 / (1 + np.exp(-sums))
            weight_max = 1.0
            factor = weight_max * full / most
            alpha = None if last else 2 * factor
        if biased:
            rows = np.vstack([rows, shifts])
        exact = rows * factor * steps / weight_max
        levels = np.rint(np.abs(exact)).astype(np.uint16)
        error = float(np.sqrt(np.mean((levels - np.abs(exact)) ** 2)))
        told.append(Deployed(weight_max, factor, scale, alpha, error, beyond))
        arrays.append(np.where(exact > 0, levels, 0) + floor)
        arrays.append(np.where(exact < 0, levels, 0) + floor)
        before = scale

    keys: dict[str, Any] = {
        "network.activation": activation,
        "learning.error": "softmax",
        "learning.centre": "none",
        "network.weight_max": [one.weight_max for one in told],
        "network.bias": "rows" if biased else "none",
    }
    if activation == "sigmoid" and len(told) > 1:
        # that of sums is none
        keys["network.alpha"] = [one.alpha or 1.0 for one in told]
    net = Network(
        sizes,
        chip,
        rule=rule,
        signed=signed,
        updates=updates,
        seed=seed,
        overrides={**keys, **(overrides or {})},
        threads=threads,
        kernel=kernel,
    )
    for at in range(net.layers):
        for names, levels in zip(_PATHWAYS[to], arrays[2 * at : 2 * at + 2], strict=True):
            for name in names:
                if name in net.pathways(at):
                    net.load(at, name, levels)
    net.calibrate(np.asarray(x)[:256])
    net.deployment = told
    return net


def outputs(net: Network) -> NDArray[np.float64]:
    """What a deployed network put out for the samples that it read, ``[sample, output]``, in the units of its weights.

    :raises dalean.ArrayError: when it was not deployed.
    """
    told = _deployed(net)[-1]
    return net.accumulators() * (told.weight_max / 2.0**net.level_bits / net.code_max / told.factor)


def _deployed(net: Network) -> list[Deployed]:
    if net.deployment is None:
        raise _wrong("the network", "was not deployed", "make it by dalean.deploy")
    return net.deployment


def signed(net: Network) -> list[tuple[NDArray[np.float64], NDArray[np.float64] | None]]:
    """Weights ``[inputs, units]`` and biases of a deployed network, of both signs and in the units that they came in; of dual
    arrays those of the p stream.

    :raises dalean.ArrayError: when it was not deployed.
    """
    found, before = [], 1.0
    for at, told in enumerate(_deployed(net)):
        plus, minus = ("e", "i") if "e" in net.pathways(at) else ("pp", "np")
        levels = net.levels(at, plus).astype(np.float64) - net.levels(at, minus)
        weights = levels * told.weight_max / 2.0**net.level_bits / told.factor
        inputs = net.sizes[at]
        found.append((weights[:inputs] / before, weights[inputs] if len(weights) > inputs else None))
        before = told.scale
    return found


def _fractions(x: ArrayLike, most: int, inputs: int) -> np.ndarray:
    """What the chip is shown, from 0 to 1."""
    x = np.asarray(x)
    whole = np.issubdtype(x.dtype, np.integer)
    x = _real("x", x)
    x = x.reshape(1, -1) if x.ndim == 1 else x
    if x.ndim != 2 or x.shape[1] != inputs or not len(x):
        raise _wrong("x", f"has the shape {x.shape}", f"give samples of {inputs} numbers, [sample, input]")
    return x / (most if whole else 1)


def _layers(layers: Any, activation: str) -> list[_Layer]:
    """Weights ``[inputs, units]`` and biases, checked."""
    if hasattr(layers, "state_dict") and hasattr(layers, "modules"):
        _check_module(layers, activation)
        layers = layers.state_dict()
    elif isinstance(layers, str | os.PathLike):
        if Path(layers).suffix == ".npz":
            with np.load(layers, allow_pickle=False) as arrays:
                layers = dict(arrays)
        else:
            layers = read_safetensors(layers)
    if isinstance(layers, Mapping):
        named = {name: _numbers(array) for name, array in layers.items()}
        found: list[Any] = []
        for name, array in named.items():
            if name.endswith("weight"):
                found.append((array.T, named.get(name[: -len("weight")] + "bias")))
            elif not name.endswith("bias") or name[: -len("bias")] + "weight" not in named:
                raise _wrong("layers", f"name {name!r}", 'arrays of dense layers are such as "0.weight" and "0.bias"')
    elif isinstance(layers, Sequence):
        found = [one if isinstance(one, tuple | list) and len(one) == 2 else (one, None) for one in layers]
    else:
        raise _wrong("layers", f"is a {type(layers).__name__}", "give a list of weights, or of pairs of weights and biases")
    checked: list[_Layer] = []
    units = None
    for at, (weights, biases) in enumerate(found):
        weights = _real(f"the weights of layer {at}", weights)
        biases = None if biases is None else _real(f"the biases of layer {at}", biases)
        fits = weights.ndim == 2 and weights.size and units in (None, weights.shape[0])
        if not fits or (biases is not None and biases.shape != weights.shape[1:]):
            shapes = f"has weights of shape {weights.shape}" + ("" if biases is None else f" and biases of {biases.shape}")
            raise _wrong(f"layer {at}", shapes, f"weights are [inputs, units], with {units or 'its'} inputs, and a bias a unit")
        if not np.isfinite(weights).all() or (biases is not None and not np.isfinite(biases).all()):
            raise _wrong(f"layer {at}", "has a weight that is no finite number", "nothing can stand for it")
        checked.append((weights, biases))
        units = weights.shape[1]
    if not checked:
        raise _wrong("layers", "are none", "give at least one")
    return checked


def _numbers(array: Any) -> np.ndarray:
    """As NumPy has it: a tensor of PyTorch may be of a kind that NumPy has not, on another device, or learnt from."""
    return array.detach().cpu().double().numpy() if hasattr(array, "detach") else np.asarray(array)


def _real(where: str, array: Any) -> np.ndarray:
    """Numbers of double precision."""
    try:
        array = np.asarray(array)
        if array.dtype.kind == "c":
            raise TypeError("complex numbers")
        return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise _wrong(where, f"cannot be read: {error}", "give real numbers") from None


def _check_module(module: Any, activation: str) -> None:
    """That a module of PyTorch has dense layers with units of that kind between them; of its own forward() nothing is known."""
    unit = {"relu": "ReLU", "sigmoid": "Sigmoid"}[activation]
    inner, leaves = [], []
    for one in module.modules():
        (inner if any(True for _ in one.children()) else leaves).append(type(one).__name__)
    other = set(leaves) - {"Linear", "Flatten", "Dropout", "Identity", unit}
    if other:
        raise _wrong("the module", f"has {', '.join(sorted(other))}", f"it may have Linear and, by activation={activation!r}, units of that kind")
    found = [name for name in leaves if name in ("Linear", unit)]
    layers = found.count("Linear")
    if set(inner) <= {"Sequential"} and layers and found != ["Linear", *[unit, "Linear"] * (layers - 1)]:
        raise _wrong("the module", f"is {', '.join(found)}", f"it has {unit} behind every Linear but the last")


def _wrong(where: str, found: str, allowed: str) -> ArrayError:
    return ArrayError(f"{where} {found}; {allowed}", where, found, allowed)

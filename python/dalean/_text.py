"""Python values as the TOML that configurations are written in."""

from __future__ import annotations

import json
import math
import numbers
import operator
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _dalean
from .errors import ConfigError

if TYPE_CHECKING:
    from .keys import Keys

    Overrides = Keys | Mapping[str, Any]
else:
    Overrides = Mapping[str, Any]
"""Keys and values: ``{"hw.cell.level_bits": 4}`` and ``{"hw": {"cell": {"level_bits": 4}}}`` say the same."""


def toml(key: str, value: Any) -> str:
    """A value as TOML."""
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value) if any(mark in repr(value) for mark in ".en") else f"{value!r}.0"
        return str(value)
    if isinstance(value, str | os.PathLike):
        # TOML's basic strings escape as JSON's do
        return json.dumps(os.fspath(value))
    if isinstance(value, Mapping):
        inside = (f"{json.dumps(str(name))} = {toml(key, one)}" for name, one in value.items())
        return "{ " + ", ".join(inside) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(key, one) for one in value) + "]"
    found = f"is {value!r}, a {type(value).__name__}"
    allowed = "values are numbers, words, True, False, lists and dicts; None takes a key back"
    raise ConfigError(f"`{key}` {found}; {allowed}", key, found, allowed)


def flat(keys: Overrides, above: str = "") -> list[tuple[str, Any]]:
    """Keys with dots and their values. A physical number, which has bounds, is one value."""
    found: list[tuple[str, Any]] = []
    for key, value in keys.items():
        if not isinstance(key, str):
            said = f"is {key!r}"
            allowed = "keys are words"
            raise ConfigError(f"a key {said}; {allowed}", "a key", said, allowed)
        name = f"{above}{key}"
        if isinstance(value, Mapping) and "typical" not in value:
            found.extend(flat(value, f"{name}."))
        else:
            found.append((name, value))
    return found


def settings(overrides: Overrides | None) -> list[str]:
    """Overrides as the command line's ``--set``; ``None`` takes a key back."""
    keys = flat(overrides or {})
    return [f"{key}={'default' if value is None else toml(key, value)}" for key, value in keys]


def text(keys: Overrides) -> str:
    """Keys as the text of a file."""
    lines = [f"{key} = {toml(key, value)}\n" for key, value in flat(keys) if value is not None]
    return "".join(lines)


def source(config: str | os.PathLike | Overrides | None) -> tuple[str, str] | None:
    """Name and text of an experiment."""
    if config is None:
        return None
    if isinstance(config, Mapping):
        return ("experiment", text(config))
    path = Path(config)
    try:
        return (str(path), path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        found, allowed = f"cannot be read: {error}", "name an experiment file, or give a dict of keys"
        raise ConfigError(f"{path} {found}; {allowed}", str(path), found, allowed) from error


def place(given: str | os.PathLike | None, variable: str, default: str) -> Path:
    """A folder: the one that is given, else that of an environment variable, else the default."""
    return Path(given if given is not None else os.environ.get(variable) or default)


def threads(given: int | None) -> int:
    """Threads: those that are asked for, else one for every core that this process may use."""
    if given is not None:
        return given
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def taps(rule: str, outputs: int, overrides: Overrides | None) -> dict[str, Any]:
    """Taps of networks with fewer outputs than the default has taps, unless somebody says how errors travel."""
    said = {key for key, _ in flat(overrides or {})}
    routed = rule.startswith("ed") and not said & {"learning.route", "learning.taps", "learning.rule"}
    return {"learning.taps": outputs} if routed and outputs < 3 else {}


SAMPLES_MAX = 1_000_000
"""Chips of one call, at most."""
Spans = str | float | Iterable[str | float]
"""Seconds after programming, or spans such as ``"1d"``: s, min, h, d, y; one or several."""


def asked(samples: int | None, chip: int | None, after: Spans | None) -> tuple[list[int], list[float]]:
    """Numbers of the chips that are asked for, and seconds after programming."""
    if samples is not None and chip is not None:
        raise _wrong("chip", "is given beside samples", "give one of both: numbers 1 to samples, or one number")
    if samples is not None:
        chips = list(range(1, _whole("samples", samples, 1, SAMPLES_MAX) + 1))
    else:
        chips = [_whole("chip", chip or 0, 0, 2**64 - 1)]
    spans = [] if after is None else [after] if isinstance(after, str | numbers.Real) else list(after)
    seconds = []
    for span in spans:
        told = span if isinstance(span, str) else f"{float(span)!r}s" if isinstance(span, numbers.Real) else ""
        found = _dalean.seconds(told)
        if found is None:
            raise _wrong("after", f"has {span!r}", 'give seconds, or a span such as "25s", "10min", "1h", "1d", "1y"')
        seconds.append(found)
    return chips, seconds


def _whole(where: str, given: Any, least: int, most: int) -> int:
    try:
        number = operator.index(given)
    except TypeError:
        number = -1
    if not least <= number <= most:
        raise _wrong(where, f"is {given!r}", f"give a whole number, {least} to {most}")
    return number


def below_hw(overrides: Overrides | None) -> list[str]:
    """Overrides of a chip as the command line's ``--set``; the prefix ``hw.`` may be left out."""
    return [one if one.startswith(("hw.", "hw=")) else f"hw.{one}" for one in settings(overrides)]


def _wrong(where: str, found: str, allowed: str) -> ConfigError:
    return ConfigError(f"{where} {found}; {allowed}", where, found, allowed)

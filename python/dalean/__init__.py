"""dalean: neural networks that learn on an analog or photonic chip whose synapses can only be non-negative.

Deterministic and all-integer: the same bits from Python, from the command line, on every machine. Three floors:

1. whole runs: :func:`train`, :func:`sweep`, :class:`Run`
2. learners: :class:`EDClassifier` (scikit-learn's style), :class:`EDPolicy` (Gymnasium)
3. the chip itself: :class:`Chip`, :class:`Network`, and :func:`deploy` for networks that were trained elsewhere

docs/python.md has an example of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._dalean import ARITHMETIC, VERSION as __version__
from .chip import Chip, Network
from .deployment import Deployed, deploy, outputs, signed
from .errors import (
    ArrayError,
    CheckpointError,
    ChipError,
    ConfigError,
    DataError,
    EnvironmentFault,
    Error,
    NetworkError,
    RunError,
)
from .runs import Report, Run, Verdict, configuration, resume, sweep, train
from .tables import Chips, Table

if TYPE_CHECKING:
    from .estimator import EDClassifier
    from .policy import EDPolicy, Lines

__all__ = [
    "ARITHMETIC",
    "ArrayError",
    "CheckpointError",
    "Chip",
    "ChipError",
    "Chips",
    "ConfigError",
    "DataError",
    "Deployed",
    "EDClassifier",
    "EDPolicy",
    "EnvironmentFault",
    "Error",
    "Lines",
    "Network",
    "NetworkError",
    "Report",
    "Run",
    "RunError",
    "Table",
    "Verdict",
    "__version__",
    "configuration",
    "deploy",
    "outputs",
    "resume",
    "signed",
    "sweep",
    "train",
]


def __getattr__(name: str) -> Any:
    # what needs other packages is imported when it is asked for
    if name == "EDClassifier":
        from .estimator import EDClassifier

        return EDClassifier
    if name in ("EDPolicy", "Lines"):
        from . import policy

        return getattr(policy, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

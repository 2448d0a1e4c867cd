"""A classifier in the style of scikit-learn, which it needs (``pip install "dalean[sklearn]"``)."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

from . import _dalean
from ._progress import Progress
from ._text import Overrides, settings, taps, text

__all__ = ["EDClassifier"]


class EDClassifier(ClassifierMixin, BaseEstimator):
    """A network that learns on a simulated chip.

    :param hidden: units of each hidden layer.
    :param epochs: passes over the examples.
    :param batch: samples of an update.
    :param rule: ``"ed"``, ``"ed_seed"``, ``"dfa"``, ``"bp"``.
    :param hw: hardware model, a built-in name or a file.
    :param rate: rate of learning; small sets of few examples take a larger one than large sets.
    :param overrides: any other keys, such as ``{"hw.cell.level_bits": 4, "network.alpha": 4}``.
    :param random_state: seed of all draws, a whole number or a NumPy generator that one is drawn from.
    :param threads: threads; no bit depends on it.

    Values become 8 bits. Those of ``uint8`` are taken as they are; all others are scaled by the least and the greatest value of
    each feature in ``fit``, and what lies beyond them later is bounded.

    After ``fit``: ``classes_``, ``n_features_in_``, ``n_iter_`` epochs, ``correct_`` right answers while learning by epoch.
    """

    def __init__(
        self,
        hidden: tuple[int, ...] = (128,),
        *,
        epochs: int = 60,
        batch: int = 8,
        rate: float = 40.0,
        rule: str = "ed",
        hw: str = "ideal",
        overrides: Overrides | None = None,
        random_state: Any = None,
        threads: int = 1,
        kernel: str | None = None,
        progress: bool | None = False,
    ) -> None:
        self.hidden = hidden
        self.epochs = epochs
        self.batch = batch
        self.rate = rate
        self.rule = rule
        self.hw = hw
        self.overrides = overrides
        self.random_state = random_state
        self.threads = threads
        self.kernel = kernel
        self.progress = progress

    def _seed(self) -> int:
        if self.random_state is None:
            return 1
        if isinstance(self.random_state, int | np.integer):
            return int(self.random_state)
        return int(self.random_state.randint(1 << 31))

    def _made(self, seed: int, x: Any, y: Any) -> _dalean.Classifier:
        keys = {
            "network.hidden": list(self.hidden),
            "learning.epochs": self.epochs,
            "learning.batch": self.batch,
            "learning.rate": float(self.rate),
            "learning.rule": self.rule,
        }
        classes = max(len(self.classes_), 2)
        keys |= taps(self.rule, classes, self.overrides)
        return _dalean.Classifier(
            "EDClassifier",
            text(keys),
            self.hw,
            settings(self.overrides),
            seed,
            self.n_features_in_,
            classes,
            x,
            y,
            self.threads,
            self.kernel,
        )

    def _values(self, X: np.ndarray) -> np.ndarray:
        if self._scale is None:
            return np.ascontiguousarray(X)
        least, span = self._scale
        return np.floor(np.clip((X - least) / span, 0, 1) * 255 + 0.5).astype(np.uint8)

    def fit(self, X: Any, y: Any) -> EDClassifier:
        """Learns from ``X`` ``[sample, feature]`` and labels ``y``.

        :raises dalean.ConfigError: when a parameter or a key cannot be.
        :raises KeyboardInterrupt: within a batch.
        """
        X, y = validate_data(self, X, y, dtype=[np.float64, np.uint8], accept_sparse=False)
        check_classification_targets(y)
        self.classes_, labels = np.unique(y, return_inverse=True)
        if len(self.classes_) > 256:
            raise ValueError(f"y holds {len(self.classes_)} classes; there are 256 at most")
        self._scale = None
        if X.dtype != np.uint8:
            least, most = X.min(axis=0), X.max(axis=0)
            # halved, so that the greatest floats have a span
            span = np.where(most > least, most - least, 1.0)
            self._scale = (least, np.where(np.isfinite(span), span, np.finfo(float).max))
        self._seed_ = self._seed()
        self._network = self._made(self._seed_, self._values(X), labels)
        self.correct_ = []
        with Progress(self.progress) as told:
            for _ in range(self._network.epochs):
                self.correct_.append(self._network.learn(told if told.show else None))
        self.n_iter_ = self._network.epoch
        return self

    def _outputs(self, X: Any) -> np.ndarray:
        check_is_fitted(self, "n_iter_")
        kinds = np.uint8 if self._scale is None else np.float64
        X = validate_data(self, X, dtype=kinds, accept_sparse=False, reset=False)
        return self._network.outputs(self._values(X))

    def decision_function(self, X: Any) -> np.ndarray:
        """Accumulators of the outputs, ``[sample, class]``: the greatest is the answer; of two classes, how much more the
        second has."""
        outputs = self._outputs(X).astype(float)
        if len(self.classes_) == 2:
            return outputs[:, 0] if outputs.shape[1] == 1 else outputs[:, 1] - outputs[:, 0]
        return outputs

    def predict(self, X: Any) -> np.ndarray:
        """The class of each sample."""
        outputs = self._outputs(X)
        if outputs.shape[1] == 1:
            return self.classes_[(outputs[:, 0] > 0).astype(int)]
        return self.classes_[np.argmax(outputs[:, : len(self.classes_)], axis=1)]

    @property
    def state_hash_(self) -> str:
        """BLAKE3 of levels and counters."""
        check_is_fitted(self, "n_iter_")
        return self._network.state_hash()

    def __getstate__(self) -> dict[str, Any]:
        state = dict(super().__getstate__())
        if "_network" in state:
            state["_network"] = state["_network"].checkpoint()
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if "_network" in self.__dict__:
            kept = self._network
            self._network = self._made(self._seed_, None, None)
            self._network.put_back(kept)

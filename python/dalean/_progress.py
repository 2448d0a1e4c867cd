"""How far work is: with tqdm where it is installed, which has a form of its own in notebooks; else in one line."""

from __future__ import annotations

import sys
from typing import Any


def _notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and "zmq" in type(shell).__module__


class Progress:
    """Hears of a run and shows it. ``show``: True, False, or None for where somebody looks."""

    def __init__(self, show: bool | None, unit: str = "samples") -> None:
        self.show = show if show is not None else _notebook() or sys.stderr.isatty()
        self.unit, self.bar, self.line = unit, None, ""

    def __call__(self, kind: str, told: Any) -> None:
        if not self.show:
            return
        if kind in ("batch", "chips", "sweep", "update"):
            if kind == "chips":
                done, total = told["done"], told["total"]
                words = f"{done:.0f} of {total:.0f} readings"
            elif kind == "sweep":
                done, total, words = told["share"], 1.0, f"{told['finished']:.0f} of {told['runs']:.0f} runs"
            else:
                epochs = told.get("epochs", told["epoch"] + 1)
                done, total = told["epoch"] * told["total"] + told["done"], epochs * told["total"]
                words = f"epoch {told['epoch'] + 1:.0f} of {epochs:.0f}"
            self._move(done, total, words)
        elif kind == "warning":
            print(f"warning: {told}", file=sys.stderr)

    def _move(self, done: float, total: float, words: str) -> None:
        if self.bar is None:
            try:
                from tqdm.auto import tqdm

                self.bar = tqdm(total=total, unit=self.unit, unit_scale=True, leave=False)
            except ImportError:
                self.bar = False
        if self.bar is False:
            self.line = f"\r{100 * done / max(total, 1e-9):3.0f} %  {words}"
            print(self.line, end="", file=sys.stderr, flush=True)
        else:
            self.bar.set_description(words, refresh=False)
            self.bar.update(done - self.bar.n)

    def close(self) -> None:
        if self.bar:
            self.bar.close()
        elif self.line:
            print("\r" + " " * len(self.line) + "\r", end="", file=sys.stderr, flush=True)
        self.bar, self.line = None, ""

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

"""Tests of the installed package, from outside the source tree: `pytest --rootdir=TESTS TESTS` in a clean environment."""

import os
from pathlib import Path

import pytest

import dalean

HERE = Path(__file__).resolve().parent


def pytest_configure(config):
    installed = Path(dalean.__file__).resolve()
    if HERE.parent in installed.parents:
        raise pytest.UsageError(f"{installed} is the source tree; install the wheel and run from elsewhere")


@pytest.fixture
def small():
    """A run of a second."""
    return {"network.hidden": [16], "learning.epochs": 1, "learning.batch": 32, "seed": 5}


@pytest.fixture(autouse=True)
def _place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("DALEAN_RUNS", "DALEAN_STORE"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def examples():
    """The examples of the repository."""
    given = os.environ.get("DALEAN_EXAMPLES")
    return Path(given) if given else HERE.parents[1] / "examples" / "python"

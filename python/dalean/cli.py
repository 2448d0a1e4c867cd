"""The command ``dalean``: the program itself, in this process."""

from __future__ import annotations

import sys

from . import _dalean


def main() -> int:
    """Runs the program with this process's arguments; gives its exit code."""
    return _dalean.main(["dalean", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())

"""What can go wrong, as exceptions.

Each says where it is, what was found, what is allowed and what to try::

    try:
        dalean.train(overrides={"hw.cell.level_bits": 99})
    except dalean.ConfigError as error:
        error.where     # 'hw.cell.level_bits'
        error.found     # 'is 99'
        error.allowed   # 'it must lie in 1..=12'
        error.try_      # the same, or what stands behind it
"""

from __future__ import annotations

__all__ = [
    "ArrayError",
    "CheckpointError",
    "ChipError",
    "ConfigError",
    "DataError",
    "EnvironmentFault",
    "Error",
    "NetworkError",
    "RunError",
]


class Error(Exception):
    """What dalean refuses.

    ``where`` names a key, a file or a part; ``found`` what was there; ``allowed`` what may be there; ``try_`` what to do.
    Those that an error does not have are ``None``; ``str(error)`` has all of them.
    """

    where: str | None
    found: str | None
    allowed: str | None
    try_: str | None

    def __init__(
        self,
        message: str,
        where: str | None = None,
        found: str | None = None,
        allowed: str | None = None,
    ) -> None:
        super().__init__(message)
        if allowed is None and "; " in message:
            # messages of one sentence: what was found; what to try
            found, allowed = message.split("; ", 1)
        self.where, self.found = where, found
        self.allowed = self.try_ = allowed
        if allowed is not None:
            for mark in ("; ", ": "):
                if mark in allowed:
                    self.allowed, self.try_ = allowed.split(mark, 1)
                    break

    def __reduce__(self):
        return (_again, (type(self), self.args, self.__dict__))


def _again(kind: type[Error], args: tuple, told: dict) -> Error:
    error = kind(*args)
    error.__dict__.update(told)
    return error


class ConfigError(Error, ValueError):
    """A configuration that cannot be used; ``where`` is its key or its file."""


class NetworkError(ConfigError):
    """A network that does not fit together, or not on the chip; ``where`` is the key."""


class DataError(Error, ValueError):
    """Data that cannot be had, or make no examples."""


class RunError(Error, RuntimeError):
    """A run that cannot be carried out, or a folder that is none."""


class CheckpointError(Error, ValueError):
    """A state that is damaged or belongs to something else."""


class ChipError(Error, ValueError):
    """An operation that the network cannot do now; nothing has moved."""


class ArrayError(Error, ValueError):
    """An array or a number that does not fit: its kind, its shape, or a number in it."""


class EnvironmentFault(Error, ValueError):
    """An environment shows or gives what it does not have; nothing was learnt from it."""

"""Tables: that of a sweep, and what chips came to."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._dalean import chip_summaries

if TYPE_CHECKING:
    import pandas
    import polars


class Columns:
    """Rows of the same names. Missing cells are ``None``.

    ``table["test_accuracy"]`` is a column, ``table.rows`` a list of dicts. pandas and polars take it by
    :meth:`to_pandas` and :meth:`to_polars`, everything that speaks Arrow's C stream interface as it is where pyarrow is
    installed.
    """

    columns: dict[str, list[Any]]
    """Cells by column."""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __getitem__(self, column: str) -> list[Any]:
        return self.columns[column]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The table row by row."""
        names = list(self.columns)
        return [dict(zip(names, cells)) for cells in zip(*self.columns.values())]

    def to_pandas(self) -> pandas.DataFrame:
        """As a data frame of pandas."""
        import pandas

        return pandas.DataFrame(self.columns)

    def to_polars(self) -> polars.DataFrame:
        """As a data frame of polars."""
        import polars

        return polars.DataFrame(self.columns, strict=False)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        import pyarrow

        return pyarrow.table(self.columns).__arrow_c_stream__(requested_schema)


def _html(heads: list[str], rows: list[list[Any]]) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in heads)
    cell = lambda value: "" if value is None else f"{value:.6g}" if isinstance(value, float) else html.escape(str(value))
    body = "".join("<tr>" + "".join(f"<td>{cell(value)}</td>" for value in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


class Table(Columns):
    """One row a point of a sweep: axes, seed, results, names. :meth:`to_parquet` writes it for whoever takes neither data frames
    nor Arrow.
    """

    def __init__(
        self,
        name: str,
        columns: list[tuple[str, str, str, list[Any]]],
        page: str | os.PathLike,
        counts: list[int],
        parquet: list[int] | bytes,
    ) -> None:
        self.name = name
        self.columns = {column: cells for column, _, _, cells in columns}
        self.labels = {column: label for column, label, _, _ in columns}
        """Words for people, by column."""
        self.units = {column: unit for column, _, unit, _ in columns}
        """Units, by column; empty of plain numbers."""
        self.page = Path(page)
        """The page of the sweep, with figures."""
        self.runs, self.finished, self.failed = counts
        self._parquet = bytes(parquet)

    def to_parquet(self, path: str | os.PathLike) -> Path:
        """Writes it as a Parquet file, not compressed."""
        path = Path(path)
        path.write_bytes(self._parquet)
        return path

    def __repr__(self) -> str:
        return f"Table({self.name!r}, {self.finished} of {self.runs} runs finished, {len(self)} points)"

    def _repr_html_(self) -> str:
        shown = [name for name in self.columns if name not in ("data_hash", "key", "run", "state_hash")]
        return _html([self.labels[name] for name in shown], [[row[name] for name in shown] for row in self.rows])


class Chips(Columns):
    """What a network knows on other chips of its kind and after a time: one row a chip and a moment, with columns ``chip``, ``after_s``
    [s after programming; ``None``: at once] and the score, named by :attr:`of`.
    """

    def __init__(self, of: str, rows: list[tuple[int, float | None, float]]) -> None:
        self.of = of
        """Name of the score."""
        chips, after, scores = zip(*rows) if rows else ((), (), ())
        self.columns = {"chip": list(chips), "after_s": list(after), of: list(scores)}
        self._rows = [tuple(row) for row in rows]

    @property
    def summary(self) -> list[dict[str, Any]]:
        """A dict a moment, as ``dalean eval --json`` has them: ``after_s``, ``chips``, ``mean``, ``sd`` (``None`` of one chip),
        ``quantiles`` by place, ``least``, ``greatest``, ``worst_chip`` (the first of those that have the least)."""
        names = ("after_s", "chips", "mean", "sd", "quantiles", "least", "greatest", "worst_chip")
        places = ("0.05", "0.25", "0.5", "0.75", "0.95")
        found = [dict(zip(names, one)) for one in chip_summaries(self._rows)]
        return [{**one, "quantiles": dict(zip(places, one["quantiles"]))} for one in found]

    def __repr__(self) -> str:
        mean = lambda one: f"{one['mean']:.6g}" + ("" if one["after_s"] is None else f" after {one['after_s']:g} s")
        said = "; ".join(mean(one) for one in self.summary)
        return f"Chips({self.of!r}, {len(set(self['chip']))} chips, mean {said})"

    def _repr_html_(self) -> str:
        heads = ["after [s]", "chips", "mean", "sd", "5 %", "median", "95 %", "worst", "chip"]
        row = lambda one: [
            *(one[name] for name in ("after_s", "chips", "mean", "sd")),
            *(one["quantiles"][place] for place in ("0.05", "0.5", "0.95")),
            *(one[name] for name in ("least", "worst_chip")),
        ]
        return _html(heads, [row(one) for one in self.summary])

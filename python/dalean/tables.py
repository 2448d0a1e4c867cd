"""The table of a sweep."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas
    import polars


class Table:
    """One row a point of a sweep: axes, seed, results, names. Missing cells are ``None``.

    ``table["test_accuracy"]`` is a column, ``table.rows`` a list of dicts. pandas and polars take it by
    :meth:`to_pandas` and :meth:`to_polars`, everything that speaks Arrow's C stream interface as it is where pyarrow is
    installed, and all others by :meth:`to_parquet`.
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
        """Cells by column."""
        self.labels = {column: label for column, label, _, _ in columns}
        """Words for people, by column."""
        self.units = {column: unit for column, _, unit, _ in columns}
        """Units, by column; empty of plain numbers."""
        self.page = Path(page)
        """The page of the sweep, with figures."""
        self.runs, self.finished, self.failed = counts
        self._parquet = bytes(parquet)

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

    def to_parquet(self, path: str | os.PathLike) -> Path:
        """Writes it as a Parquet file, not compressed."""
        path = Path(path)
        path.write_bytes(self._parquet)
        return path

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

    def __repr__(self) -> str:
        return f"Table({self.name!r}, {self.finished} of {self.runs} runs finished, {len(self)} points)"

    def _repr_html_(self) -> str:
        shown = [name for name in self.columns if name not in ("data_hash", "key", "run", "state_hash")]
        head = "".join(f"<th>{html.escape(self.labels[name])}</th>" for name in shown)
        cell = lambda value: "" if value is None else f"{value:.6g}" if isinstance(value, float) else html.escape(str(value))
        body = "".join(
            "<tr>" + "".join(f"<td>{cell(row[name])}</td>" for name in shown) + "</tr>" for row in self.rows
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

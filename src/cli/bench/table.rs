//! Figures as rows, for people and for programs.

use serde_json::{Map, Value};

/// What a table says in one place.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    /// A name.
    Text(String),
    /// A count or size.
    Count(u64),
    /// A figure.
    Figure(f64),
    /// Not measured, or without meaning here.
    Nothing,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Count(count as u64)
    }
}

impl From<f64> for Cell {
    fn from(figure: f64) -> Self {
        Self::Figure(figure)
    }
}

impl From<Option<f64>> for Cell {
    fn from(figure: Option<f64>) -> Self {
        figure.map_or(Self::Nothing, Self::Figure)
    }
}

/// One column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Name in JSON, with the unit.
    pub(super) key: &'static str,
    /// Head on the terminal, with the unit; none where only programs see it.
    pub(super) head: Option<&'static str>,
    /// Digits after the point.
    pub(super) digits: usize,
}

/// A column that people see.
pub(super) const fn shown(key: &'static str, head: &'static str, digits: usize) -> Column {
    Column { key, head: Some(head), digits }
}

/// A column for programs alone.
pub(super) const fn kept(key: &'static str) -> Column {
    Column { key, head: None, digits: 0 }
}

/// Figures of one kind.
#[derive(Debug)]
pub(super) struct BenchTable {
    /// `event` of each row in JSON.
    pub(super) event: &'static str,
    /// What was measured, in one line.
    pub(super) title: String,
    /// What a reader must know, a line each.
    pub(super) notes: Vec<String>,
    pub(super) columns: &'static [Column],
    pub(super) rows: Vec<Vec<Cell>>,
}

impl BenchTable {
    /// An empty table.
    pub(super) fn new(
        event: &'static str,
        title: impl Into<String>,
        columns: &'static [Column],
    ) -> Self {
        Self { event, title: title.into(), notes: Vec::new(), columns, rows: Vec::new() }
    }

    /// Adds a row: one cell a column.
    ///
    /// # Panics
    /// When the numbers of cells and columns differ.
    pub(super) fn row(&mut self, cells: Vec<Cell>) {
        assert_eq!(cells.len(), self.columns.len(), "one cell a column");
        self.rows.push(cells);
    }

    /// One JSON object a row.
    pub(super) fn json(&self) -> Vec<Value> {
        self.rows.iter().map(|row| self.object(row)).collect()
    }

    fn object(&self, row: &[Cell]) -> Value {
        let mut object = Map::from_iter([("event".to_owned(), self.event.into())]);
        for (column, cell) in self.columns.iter().zip(row) {
            let value = match cell {
                Cell::Text(text) => text.clone().into(),
                Cell::Count(count) => (*count).into(),
                Cell::Figure(figure) => (*figure).into(),
                Cell::Nothing => Value::Null,
            };
            object.insert(column.key.into(), value);
        }
        object.into()
    }

    /// Aligned text: names to the left, numbers to the right.
    pub(super) fn text(&self) -> String {
        let seen: Vec<_> =
            self.columns.iter().enumerate().filter_map(|(at, c)| Some((at, c, c.head?))).collect();
        let mut lines = vec![seen.iter().map(|(.., head)| (*head).to_owned()).collect::<Vec<_>>()];
        for row in &self.rows {
            lines.push(seen.iter().map(|(at, column, _)| show(&row[*at], column.digits)).collect());
        }
        let left: Vec<bool> = seen
            .iter()
            .map(|(at, ..)| self.rows.iter().any(|row| matches!(row[*at], Cell::Text(_))))
            .collect();
        let width = |at: usize| lines.iter().map(|l| l[at].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..seen.len()).map(width).collect();
        let mut text = format!("{}\n", self.title);
        for line in lines {
            let cells = line.iter().zip(&widths).zip(&left).map(|((cell, &width), left)| {
                if *left { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            let line = cells.collect::<Vec<_>>().join("  ");
            text += &format!("  {}\n", line.trim_end());
        }
        for note in &self.notes {
            text += &format!("  {note}\n");
        }
        text
    }
}

fn show(cell: &Cell, digits: usize) -> String {
    match cell {
        Cell::Text(text) => text.clone(),
        Cell::Count(count) => count.to_string(),
        Cell::Figure(figure) => format!("{figure:.digits$}"),
        Cell::Nothing => "-".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    const COLUMNS: &[Column] = &[
        shown("kernel", "kernel", 0),
        shown("batch", "batch", 0),
        shown("gmac_per_second", "GMAC/s", 1),
        kept("seconds_median"),
    ];

    fn table() -> BenchTable {
        let mut table = BenchTable::new("read", "reads", COLUMNS);
        table.row(vec!["scalar".into(), 1usize.into(), 0.25.into(), None.into()]);
        table.row(vec!["amx".into(), 128usize.into(), 1825.04.into(), 1.5.into()]);
        table.notes.push("best of all rounds".into());
        table
    }

    #[test]
    fn names_stand_left_and_numbers_right() {
        expect![[r#"
            reads
              kernel  batch  GMAC/s
              scalar      1     0.2
              amx       128  1825.0
              best of all rounds
        "#]]
        .assert_eq(&table().text());
    }

    #[test]
    fn programs_get_every_column_of_every_row() {
        let json = table().json();
        assert_eq!(
            json[1],
            serde_json::json!({"event": "read", "kernel": "amx", "batch": 128,
                "gmac_per_second": 1825.04, "seconds_median": 1.5})
        );
        assert!(json[0]["seconds_median"].is_null() && json.len() == 2);
    }
}

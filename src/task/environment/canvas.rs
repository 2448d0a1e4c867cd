//! Pictures in characters, for people.
//!
//! ```text
//! place    column to the right, row downwards, each to the nearest character, halves up; what lies outside is not drawn
//! line     as many points as it is long in characters, ends included
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::fmt;

use super::fine::Fine;

/// A picture that is being drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    columns: usize,
    glyphs: Vec<char>,
}

impl Canvas {
    /// An empty one.
    #[must_use]
    pub fn new(columns: usize, rows: usize) -> Self {
        Self { columns, glyphs: vec![' '; columns * rows] }
    }

    /// Puts a character at a column and a row.
    pub fn put(&mut self, [column, row]: [Fine; 2], glyph: char) {
        let nearest = |x: Fine| usize::try_from((x + Fine::lit("0.5")).floor().to_num::<i64>());
        let (Ok(column), Ok(row)) = (nearest(column), nearest(row)) else { return };
        if column < self.columns
            && let Some(place) = self.glyphs.get_mut(row * self.columns + column)
        {
            *place = glyph;
        }
    }

    /// Draws a line from one place to another.
    pub fn line(&mut self, from: [Fine; 2], to: [Fine; 2], glyph: char) {
        let [columns, rows] = [to[0] - from[0], to[1] - from[1]];
        let parts = columns.abs().max(rows.abs()).ceil().to_num::<i64>().max(1);
        for part in 0..=parts {
            let share = Fine::from_num(part) / Fine::from_num(parts);
            self.put([from[0] + share * columns, from[1] + share * rows], glyph);
        }
    }
}

impl fmt::Display for Canvas {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in self.glyphs.chunks(self.columns) {
            writeln!(f, "{}", String::from_iter(row).trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(column: i32, row: i32) -> [Fine; 2] {
        [column, row].map(Fine::from_num)
    }

    #[test]
    fn lines_reach_both_ends_and_nothing_is_drawn_outside() {
        let mut canvas = Canvas::new(5, 3);
        canvas.line(at(4, 0), at(0, 2), 'o');
        canvas.line(at(-9, 1), at(0, 1), '-');
        canvas.put(at(5, 0), 'x');
        canvas.put(at(0, 3), 'x');
        assert_eq!(canvas.to_string(), "    o\n- oo\noo\n");
    }
}

//! Lines of a terminal in columns.

/// Cells of lines under one another; `right` are the columns of numbers. The last column is not filled up.
pub(super) fn columns(lines: &[Vec<String>], right: &[usize]) -> String {
    let width =
        |at: usize| lines.iter().filter_map(move |line| line.get(at)).map(|c| c.chars().count());
    let count = lines.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(|at| width(at).max().unwrap_or(0)).collect();
    let text = lines.iter().map(|line| {
        let cells = line.iter().enumerate().map(|(at, cell)| {
            let wide = widths[at];
            if right.contains(&at) { format!("{cell:>wide$}") } else { format!("{cell:wide$}") }
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    });
    text.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_to_the_right_and_words_to_the_left() {
        let line = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let lines = [line(["run", "n", "why"]), line(["a", "10", "-"])];
        assert_eq!(columns(&lines, &[1]), "run   n  why\na    10  -");
    }
}

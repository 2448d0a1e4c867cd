//! What wires take, against an exact solve of every node of a tile.
//!
//! ```text
//! node      (r, c) of a row and of a column, joined by the cell's conductance; neighbours by that of a segment
//! ends      row r: a segment to its driver at x_r;   column c: a segment to its amplifier at 0
//! current   of column c: what flows into its amplifier
//! ```
//!
//! The nodes are solved by a sparse Cholesky factorisation (`nalgebra-sparse`), which is held against ladders whose solution is known. Conductances
//! are in those of a cell at the ceiling, so a segment conducts 1 / ratio.

use std::fmt::Write as _;

use dalean::hardware::{Conducting, Wires};
use nalgebra_sparse::factorization::CscCholesky;
use nalgebra_sparse::na::DMatrix;
use nalgebra_sparse::{CooMatrix, CscMatrix};

/// A tile: conductances row by row, and drives.
struct Circuit {
    rows: usize,
    columns: usize,
    cells: Vec<f64>,
    drives: Vec<f64>,
}

/// Numbers of the test's own, 0 to 1.
fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    }
}

impl Circuit {
    /// Levels that are anything, or whose distribution is that of a tile that has learnt: most are low.
    fn random(side: usize, low: bool, seed: u64) -> Self {
        let mut next = numbers(seed);
        let level = |u: f64| (255.0 * if low { u.powi(4) } else { u }).round() / 255.0;
        let cells = (0..side * side).map(|_| level(next())).collect();
        let drives = (0..side).map(|_| (255.0 * next()).round()).collect();
        Self { rows: side, columns: side, cells, drives }
    }

    /// Every column's current, exactly.
    fn exact(&self, ratio: f64) -> Vec<f64> {
        let (rows, columns) = (self.rows, self.columns);
        let nodes = 2 * rows * columns;
        let node = |row: usize, column: usize, of: usize| (row * columns + column) * 2 + of;
        let mut matrix = CooMatrix::new(nodes, nodes);
        let mut into = DMatrix::zeros(nodes, 1);
        let segment = 1.0 / ratio;
        let mut join = |a: usize, b: Option<usize>, g: f64| {
            matrix.push(a, a, g);
            if let Some(b) = b {
                matrix.push(b, b, g);
                matrix.push(a, b, -g);
                matrix.push(b, a, -g);
            }
        };
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
            let [of_row, of_column] = [0, 1].map(|of| node(row, column, of));
            join(of_row, Some(of_column), self.cells[row * columns + column]);
            // to the neighbour, or to what stands at the end
            join(of_row, (column > 0).then(|| node(row, column.wrapping_sub(1), 0)), segment);
            join(of_column, (row > 0).then(|| node(row.wrapping_sub(1), column, 1)), segment);
            if column == 0 {
                into[(of_row, 0)] = self.drives[row] * segment;
            }
        }
        let solved =
            CscCholesky::factor(&CscMatrix::from(&matrix)).expect("every node leads to an end");
        let voltages = solved.solve(&into);
        (0..columns).map(|column| voltages[(node(0, column, 1), 0)] * segment).collect()
    }

    /// The same by the law of the program; and as if what wires take were taken off, `1 - s`.
    fn law(&self, ratio: f64) -> [Vec<f64>; 2] {
        let segment = (ratio * Wires::SEGMENT_MAX as f64).round() as u64;
        let law = Conducting::new(None, Some(Wires { segment }), 255).expect("wires");
        let levels: Vec<u16> = self.cells.iter().map(|g| (g * 255.0).round() as u16).collect();
        let through = law.tile(&levels, self.columns).cells;
        let left: Vec<f64> = through.iter().map(|&e| f64::from(e) / (255.0 * 256.0)).collect();
        let taken = self.cells.iter().zip(&left);
        let taken = taken.map(|(&g, &e)| if e > 0.0 { g * (2.0 - g / e) } else { 0.0 });
        [self.currents(&left), self.currents(&taken.collect::<Vec<_>>())]
    }

    fn currents(&self, cells: &[f64]) -> Vec<f64> {
        let column = |column: usize| {
            let rows = self.drives.iter().enumerate();
            rows.map(|(row, x)| x * cells[row * self.columns + column]).sum()
        };
        (0..self.columns).map(column).collect()
    }
}

/// Root of the mean square of differences.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len() as f64).sqrt()
}

/// Voltages along a ladder of `n` equal shunts over the voltage at its head: `cosh((n + 1/2 - j) t) / cosh((n + 1/2) t)`,
/// `cosh t = 1 + series / (2 shunt)`.
fn ladder(n: usize, series: f64, shunt: f64) -> impl Fn(usize) -> f64 {
    let t = (1.0 + series / (2.0 * shunt)).acosh();
    let whole = n as f64 + 0.5;
    move |j| ((whole - j as f64) * t).cosh() / (whole * t).cosh()
}

/// A row of cells is a ladder whose shunts are cells with a segment of their column; a column is one turned round.
#[test]
fn the_exact_solve_is_that_of_ladders() {
    for (n, ratio) in [(1, 0.3), (5, 0.01), (40, 1e-4), (64, 1e-2)] {
        let along = ladder(n, ratio, 1.0 + ratio);
        let row = Circuit { rows: 1, columns: n, cells: vec![1.0; n], drives: vec![3.0] };
        for (column, current) in row.exact(ratio).into_iter().enumerate() {
            let wanted = 3.0 * along(column + 1) / (1.0 + ratio);
            assert!((current / wanted - 1.0).abs() < 1e-9, "{n} {ratio} {column}");
        }
        let column = Circuit { rows: n, columns: 1, cells: vec![1.0; n], drives: vec![3.0; n] };
        let wanted = 3.0 * (1.0 - along(1)) / ratio;
        assert!((column.exact(ratio)[0] / wanted - 1.0).abs() < 1e-9, "{n} {ratio}");
    }
    // one cell: three resistances in series
    let one = Circuit { rows: 1, columns: 1, cells: vec![0.5], drives: vec![1.0] };
    assert!((one.exact(0.25)[0] - 1.0 / 2.5).abs() < 1e-12);
}

/// Fails when a segment is counted from the wrong end, or once too often.
#[test]
fn the_law_is_the_exact_solve_within_a_few_hundredths_of_the_drop() {
    for (side, low, ratio) in [
        (16, false, 1e-4),
        (16, true, 1e-3),
        (24, false, 1e-3),
        (32, true, 1e-4),
        (32, false, 1e-3),
    ] {
        let circuit = Circuit::random(side, low, 7);
        let exact = circuit.exact(ratio);
        let drop = apart(&circuit.currents(&circuit.cells), &exact);
        let [law, taken] = circuit.law(ratio).map(|of| apart(&of, &exact) / drop);
        assert!(law < 0.03, "{side} {low} {ratio}: {law}");
        assert!(taken > law, "{side} {low} {ratio}: {taken}");
    }
}

const SIDES: [usize; 4] = [16, 32, 64, 128];
const RATIOS: [f64; 7] = [1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3];

/// One row of the table.
struct Row {
    side: usize,
    /// Of the mean current.
    drop: f64,
    /// Of the drop: the law, and `1 - s`.
    errors: [f64; 2],
    /// The greatest error of the law in steps of a converter of 8 bits whose range is the greatest current.
    steps: f64,
}

fn row(side: usize, ratio: f64, low: bool) -> Row {
    let circuit = Circuit::random(side, low, 11 + side as u64);
    let ideal = circuit.currents(&circuit.cells);
    let exact = circuit.exact(ratio);
    let drop = apart(&ideal, &exact);
    let mean = ideal.iter().sum::<f64>() / side as f64;
    let [law, taken] = circuit.law(ratio);
    let errors = [&law, &taken].map(|of| apart(of, &exact) / drop);
    let step = exact.iter().fold(0.0, |a: f64, b| a.max(*b)) / 255.0;
    let greatest = law.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Row { side, drop: drop / mean, errors, steps: greatest / step }
}

/// Writes docs/img/ir-drop.svg and prints the table of docs/results/devices.md.
#[test]
#[ignore = "solves tiles of 128 x 128: cargo test --release --test it ir_drop -- --ignored --nocapture"]
fn table_and_figure() {
    let mut all = vec![];
    for low in [false, true] {
        println!("\n{}\n", if low { "most cells low (u^4)" } else { "any levels (u)" });
        println!(
            "| tile | segment / cell | drop | error of 1 / (1 + s) | of 1 - s | greatest error, 8-bit steps |"
        );
        println!("|---|--:|--:|--:|--:|--:|");
        for (side, ratio) in SIDES.iter().flat_map(|side| RATIOS.iter().map(move |r| (*side, *r))) {
            let row = row(side, ratio, low);
            let [drop, law, taken] = [row.drop, row.errors[0], row.errors[1]].map(|x| 100.0 * x);
            println!(
                "| {side} x {side} | {ratio:.0e} | {drop:.2} % | {law:.2} % | {taken:.1} % | {:.2} |",
                row.steps
            );
            if !low {
                all.push(row);
            }
        }
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/img/ir-drop.svg");
    std::fs::write(path, figure(&all)).unwrap();
}

/// Error over drop against the drop, both in logarithms.
fn figure(rows: &[Row]) -> String {
    let [width, height, left, top, right, bottom] = [640.0, 400.0, 70.0, 30.0, 150.0, 50.0];
    let x = |drop: f64| left + (drop.log10() + 4.0) / 4.0 * (width - left - right);
    let y = |error: f64| height - bottom - (error.log10() + 4.0) / 5.0 * (height - top - bottom);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    let text = |svg: &mut String, at: [f64; 2], anchor: &str, text: &str| {
        let [x, y] = at;
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"#222\">{text}</text>"
        );
    };
    let ends = [x(1e-4), x(1.0), y(1e-4), y(10.0)];
    for (value, name) in [
        (1e-4, "0.01 %"),
        (1e-3, "0.1 %"),
        (1e-2, "1 %"),
        (0.1, "10 %"),
        (1.0, "100 %"),
        (10.0, "1000 %"),
    ] {
        let at = y(value);
        let _ =
            writeln!(svg, "<path d=\"M{:.1} {at:.1}H{:.1}\" stroke=\"#ddd\"/>", ends[0], ends[1]);
        text(&mut svg, [ends[0] - 6.0, at + 4.0], "end", name);
        if value <= 1.0 {
            let at = x(value);
            let _ = writeln!(
                svg,
                "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"#ddd\"/>",
                ends[2], ends[3]
            );
            text(&mut svg, [at, ends[2] + 18.0], "middle", name);
        }
    }
    let middle = (ends[0] + ends[1]) / 2.0;
    text(&mut svg, [middle, height - 10.0], "middle", "current that wires take, of all");
    text(&mut svg, [left - 50.0, top - 12.0], "start", "error, of what wires take");
    for (at, side) in SIDES.iter().enumerate() {
        let colour = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"][at];
        for (law, dash) in [(0, ""), (1, " stroke-dasharray=\"5 4\"")] {
            let of = rows.iter().filter(|row| row.side == *side);
            let points: Vec<_> = of.map(|row| [x(row.drop), y(row.errors[law])]).collect();
            let path: Vec<_> = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
            let _ = writeln!(
                svg,
                "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dash}/>",
                path.join("L")
            );
        }
        let at = top + 20.0 + 18.0 * at as f64;
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {at:.1}h20\" stroke=\"{colour}\" stroke-width=\"1.6\"/>",
            ends[1] + 12.0
        );
        text(&mut svg, [ends[1] + 38.0, at + 4.0], "start", &format!("{side} x {side}"));
    }
    text(&mut svg, [ends[1] + 12.0, top + 110.0], "start", "whole: 1 / (1 + s)");
    text(&mut svg, [ends[1] + 12.0, top + 126.0], "start", "dashed: 1 - s");
    svg + "</svg>\n"
}

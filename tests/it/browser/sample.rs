//! Invented sweeps, as views of tables: a grid like that of a study of level bits, a large one drawn at random, odd ones.

use dalean::lab::report::sweep::{Figures, Learning, Refused, ShownAxis, SweepView};
use dalean::lab::table::{Column, ColumnUnit, Role, Table, Values};

/// A sweep that owns what its view borrows.
pub(crate) struct Sample {
    pub(crate) name: &'static str,
    pub(crate) table: Table,
    pub(crate) axes: Vec<ShownAxis>,
    pub(crate) figures: Figures,
    pub(crate) refused: Vec<Refused>,
    pub(crate) learning: Learning,
}

/// Words between 0 and 1, the same every time.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((word ^ (word >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal: mean 0, deviation 1.
    pub(crate) fn bell(&mut self) -> f64 {
        (0..12).map(|_| self.roll()).sum::<f64>() - 6.0
    }
}

pub(crate) fn column(name: &str, unit: ColumnUnit, role: Role, values: Values) -> Column {
    Column { name: name.into(), label: name.replace('_', " "), unit, role, values }
}

pub(crate) fn axis(name: &str, number: bool, log: bool, order: &[&str]) -> ShownAxis {
    let order = order.iter().map(|&value| value.to_owned()).collect();
    ShownAxis { name: name.into(), label: name.replace('_', " "), number, log, order }
}

const ROUNDINGS: [&str; 3] = ["nearest", "stochastic", "separable"];
const RULES: [&str; 2] = ["ed", "bp"];

impl Sample {
    pub(crate) fn view(&self) -> SweepView<'_> {
        SweepView {
            name: self.name,
            title: "How many level bits does learning need?",
            about: "Accuracy on optdigits against the level bits of the cells, with three roundings of increments and two \
                    rules. The question: at what precision does stochastic rounding stop mattering & <why>?\n\n\
                    Each setting was run with three seeds.",
            table: &self.table,
            axes: &self.axes,
            figures: self.figures.clone(),
            learning: &self.learning,
            refused: &self.refused,
            not_simulated: NOTES.get_or_init(|| {
                vec![
                    "drift = \"5 % a decade\"".into(),
                    "read_disturb = \"none below 0.3 V\"".into(),
                ]
            }),
            version: "0.1.0",
        }
    }

    /// 12 level bits x 3 roundings x 2 rules x 3 seeds = 216 points; some not finished, some refused.
    pub(crate) fn grid() -> Self {
        let mut dice = Dice::new(1);
        let (mut bits, mut roundings, mut rules, mut seeds) = (vec![], vec![], vec![], vec![]);
        let mut results: [Vec<Option<f64>>; 6] = Default::default();
        let (mut cycles, mut pulses) = (vec![], vec![]);
        let (mut hashes, mut runs) = (vec![], vec![]);
        for bit in 1..=12i64 {
            for rounding in ROUNDINGS {
                for rule in RULES {
                    for seed in 0..3i64 {
                        let row = bits.len();
                        let done = row % 47 != 46 && !(bit == 12 && rule == "bp");
                        let knee = if rounding == "nearest" { 7.0 } else { 3.2 };
                        let top = if rule == "bp" { 0.975 } else { 0.962 };
                        let rise = 1.0 / (1.0 + (-(bit as f64 - knee) * 1.1).exp());
                        let accuracy =
                            0.1 + (top - 0.1) * rise + 0.012 * dice.bell() * (1.2 - rise);
                        let accuracy = (accuracy.clamp(0.08, 0.99) * 1797.0).round() / 1797.0;
                        let joules = 2.1e-6 * 1.31f64.powi(bit as i32) * (1.0 + 0.1 * dice.roll());
                        let joules = joules * if rounding == "nearest" { 0.8 } else { 1.0 };
                        let count = (4.0e6 * (1.0 + rise) * (1.0 + 0.1 * dice.roll())) as i64;
                        bits.push(Some(bit));
                        roundings.push(Some(rounding.to_owned()));
                        rules.push(Some(rule.to_owned()));
                        seeds.push(Some(seed));
                        let numbers = [
                            accuracy,
                            accuracy + 0.006,
                            joules,
                            joules * 0.4,
                            joules * 3.1,
                            0.31 + 0.2 * rise,
                        ];
                        for (column, number) in results.iter_mut().zip(numbers) {
                            column.push(done.then_some(number));
                        }
                        cycles.push(done.then_some(count / 3));
                        pulses.push(done.then_some(count));
                        hashes.push(done.then(|| format!("{:016x}{row:048x}", row * 7919 + 3)));
                        runs.push(done.then(|| format!("runs/{row:04x}/report.html")));
                    }
                }
            }
        }
        // every run climbs to its validation accuracy in six epochs
        let climb = |validation: &Option<f64>| -> Vec<(u32, f64)> {
            let top = validation.unwrap_or_default();
            let at = |epoch: u32| (epoch, 0.1 + (top - 0.1) * f64::from(epoch) / 6.0);
            validation.iter().flat_map(|_| (0..=6).map(at)).collect()
        };
        let learning = Learning {
            label: "validation accuracy".into(),
            shares: true,
            rows: results[1].iter().map(climb).collect(),
        };
        let [accuracy, validation, joules, low, high, floor] = results;
        let real =
            |name: &str, unit, values| column(name, unit, Role::Result, Values::Real(values));
        let columns = vec![
            column("level_bits", ColumnUnit::Plain, Role::Axis, Values::Whole(bits)),
            column("rounding", ColumnUnit::Plain, Role::Axis, Values::Text(roundings)),
            column("rule", ColumnUnit::Plain, Role::Axis, Values::Text(rules)),
            column("seed", ColumnUnit::Plain, Role::Seed, Values::Whole(seeds)),
            real("test_accuracy", ColumnUnit::Fraction, accuracy),
            real("validation_accuracy", ColumnUnit::Fraction, validation),
            real("joules", ColumnUnit::Joules, joules),
            real("joules_low", ColumnUnit::Joules, low),
            real("joules_high", ColumnUnit::Joules, high),
            real("floor_fraction", ColumnUnit::Fraction, floor),
            column("cycles", ColumnUnit::Cycles, Role::Result, Values::Whole(cycles)),
            column("pulses", ColumnUnit::Count, Role::Result, Values::Whole(pulses)),
            column("state_hash", ColumnUnit::Plain, Role::Name, Values::Text(hashes)),
            column("run", ColumnUnit::Plain, Role::Name, Values::Text(runs)),
        ];
        let refused = (1..=3).map(|point| Refused {
            point: 216 + point,
            what: format!("level_bits = 13, rule = ed, seed = {point}"),
            why: "a cell has at most 12 <level bits>; lower `hw.cell.level_bits`".into(),
        });
        Self {
            name: "bits-by-rounding",
            table: Table { columns },
            axes: vec![
                axis(
                    "level_bits",
                    true,
                    false,
                    &["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12"],
                ),
                axis("rounding", false, false, &ROUNDINGS),
                axis("rule", false, false, &RULES),
            ],
            figures: Figures {
                x: "level_bits".into(),
                y: "test_accuracy".into(),
                series: Some("rounding".into()),
                panel: Some("rule".into()),
                heat: Some(["level_bits".into(), "rounding".into()]),
                cost: Some("joules".into()),
                baseline: None,
                published: vec![],
            },
            refused: refused.collect(),
            learning,
        }
    }

    /// Values drawn at random: `rows` x 25 columns, no repetitions.
    pub(crate) fn large(rows: usize) -> Self {
        let mut dice = Dice::new(2);
        let mut columns = Vec::new();
        let noise: Vec<f64> = (0..rows).map(|_| 10f64.powf(-4.0 + 3.0 * dice.roll())).collect();
        let rate: Vec<f64> = (0..rows).map(|_| 0.5 + 7.5 * dice.roll()).collect();
        let bits: Vec<i64> = (0..rows).map(|_| 1 + (12.0 * dice.roll()) as i64).collect();
        let rules: Vec<usize> = (0..rows).map(|_| (2.0 * dice.roll()) as usize).collect();
        let done = |row: usize| row % 97 != 5;
        let score = |row: usize, dice: &mut Dice| {
            let rise = 1.0 / (1.0 + (-(bits[row] as f64 - 4.0)).exp());
            let loss = 0.06 * (noise[row] / 0.01).ln().max(0.0) + 0.004 * (rate[row] - 3.0).powi(2);
            (0.1 + 0.87 * rise - loss + 0.01 * dice.bell()).clamp(0.05, 0.99)
        };
        let all = |values: &[f64]| Values::Real(values.iter().copied().map(Some).collect());
        columns.push(column("write_noise", ColumnUnit::Plain, Role::Axis, all(&noise)));
        columns.push(column("learning_rate", ColumnUnit::Plain, Role::Axis, all(&rate)));
        let whole = bits.iter().copied().map(Some).collect();
        columns.push(column("level_bits", ColumnUnit::Plain, Role::Axis, Values::Whole(whole)));
        let words = rules.iter().map(|&rule| Some(RULES[rule].to_owned())).collect();
        columns.push(column("rule", ColumnUnit::Plain, Role::Axis, Values::Text(words)));
        let scores = (0..rows).map(|row| done(row).then(|| score(row, &mut dice))).collect();
        columns.push(column(
            "test_accuracy",
            ColumnUnit::Fraction,
            Role::Result,
            Values::Real(scores),
        ));
        let joules = (0..rows)
            .map(|row| {
                done(row).then(|| {
                    1e-9 * 1.9f64.powi(bits[row] as i32)
                        * (0.5 + rate[row])
                        * (0.8 + 0.4 * dice.roll())
                })
            })
            .collect();
        columns.push(column("joules", ColumnUnit::Joules, Role::Result, Values::Real(joules)));
        for more in columns.len()..23 {
            let values = (0..rows).map(|row| done(row).then(|| 1e6 * dice.roll())).collect();
            columns.push(column(
                &format!("count_{more}"),
                ColumnUnit::Count,
                Role::Result,
                Values::Real(values),
            ));
        }
        let hashes = (0..rows).map(|row| done(row).then(|| format!("{row:064x}"))).collect();
        columns.push(column("state_hash", ColumnUnit::Plain, Role::Name, Values::Text(hashes)));
        let runs =
            (0..rows).map(|row| done(row).then(|| format!("runs/{row:05}/report.html"))).collect();
        columns.push(column("run", ColumnUnit::Plain, Role::Name, Values::Text(runs)));
        Self {
            name: "drawn-at-random",
            table: Table { columns },
            axes: vec![
                axis("write_noise", true, true, &[]),
                axis("learning_rate", true, false, &[]),
                axis(
                    "level_bits",
                    true,
                    false,
                    &["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12"],
                ),
                axis("rule", false, false, &RULES),
            ],
            figures: Figures {
                x: "level_bits".into(),
                y: "test_accuracy".into(),
                series: Some("rule".into()),
                panel: None,
                heat: Some(["level_bits".into(), "write_noise".into()]),
                cost: Some("joules".into()),
                baseline: None,
                published: vec![],
            },
            refused: vec![],
            learning: Learning::default(),
        }
    }

    /// One text axis, no seed, no cost, no names.
    pub(crate) fn words() -> Self {
        let devices =
            ["ideal", "prime", "isaac", "</script><b>a very long name of a device & more"];
        let values = devices.iter().map(|&name| Some(name.to_owned())).collect();
        let scores = vec![Some(0.97), Some(0.91), None, Some(0.88)];
        Self {
            name: "words",
            table: Table {
                columns: vec![
                    column("device", ColumnUnit::Plain, Role::Axis, Values::Text(values)),
                    column(
                        "test_accuracy",
                        ColumnUnit::Fraction,
                        Role::Result,
                        Values::Real(scores),
                    ),
                ],
            },
            axes: vec![axis("device", false, false, &devices)],
            figures: Figures {
                x: "device".into(),
                y: "test_accuracy".into(),
                ..Figures::default()
            },
            refused: vec![],
            learning: Learning::default(),
        }
    }

    /// Nothing has finished.
    pub(crate) fn hollow() -> Self {
        let mut sample = Self::grid();
        sample.learning.rows.iter_mut().for_each(Vec::clear);
        for column in &mut sample.table.columns {
            match &mut column.values {
                Values::Real(values) => values.iter_mut().for_each(|value| *value = None),
                Values::Whole(values) if column.role == Role::Result => {
                    values.iter_mut().for_each(|value| *value = None)
                }
                _ => {}
            }
        }
        sample
    }

    /// No rows at all.
    pub(crate) fn empty() -> Self {
        let table = Table { columns: vec![] };
        let (figures, learning) = (Figures::default(), Learning::default());
        Self { name: "empty", table, axes: vec![], figures, refused: vec![], learning }
    }
}

static NOTES: std::sync::OnceLock<Vec<String>> = std::sync::OnceLock::new();

//! Laws of the page and of figures for papers: complete, escaped, no word that is no number, the same every time.

use super::settings::Settings;
use super::{Figures, Learning, Refused, ShownAxis, SweepView, figures, html, json, png, text};
use crate::lab::table::{Column, ColumnUnit, Role, Table, Values};

struct Sample {
    table: Table,
    axes: Vec<ShownAxis>,
    figures: Figures,
    refused: Vec<Refused>,
    notes: Vec<String>,
    learning: Learning,
}

const NASTY: &str = "</script><b>\"'&\u{2028}";

fn column(name: &str, unit: ColumnUnit, role: Role, values: Values) -> Column {
    Column { name: name.into(), label: name.into(), unit, role, values }
}

fn axis(name: &str, number: bool, order: &[&str]) -> ShownAxis {
    let order = order.iter().map(|&text| text.to_owned()).collect();
    ShownAxis { name: name.into(), label: name.into(), number, log: false, order }
}

impl Sample {
    /// Bits 1, 2, 4 by two words by two seeds; the last row has no result.
    fn new() -> Self {
        let (mut bits, mut words, mut seeds) = (vec![], vec![], vec![]);
        let (mut scores, mut joules, mut lows, mut highs) = (vec![], vec![], vec![], vec![]);
        for bit in [1i64, 2, 4] {
            for word in ["z", NASTY] {
                for seed in 0..2i64 {
                    let done = !(bit == 4 && word == NASTY && seed == 1);
                    let score = 0.5 + 0.1 * bit as f64 + 0.01 * seed as f64;
                    bits.push(Some(bit));
                    words.push(Some(word.to_owned()));
                    seeds.push(Some(i64::MAX - seed));
                    scores.push(done.then_some(score));
                    joules.push(done.then_some(1e-9 * score));
                    lows.push(done.then_some(0.5e-9 * score));
                    highs.push(done.then_some(4e-9 * score));
                }
            }
        }
        let real = |name, unit, values| column(name, unit, Role::Result, Values::Real(values));
        Self {
            table: Table {
                columns: vec![
                    column("bits", ColumnUnit::Plain, Role::Axis, Values::Whole(bits)),
                    column("word", ColumnUnit::Plain, Role::Axis, Values::Text(words)),
                    column("seed", ColumnUnit::Plain, Role::Seed, Values::Whole(seeds)),
                    real("score", ColumnUnit::Fraction, scores),
                    real("joules", ColumnUnit::Joules, joules),
                    real("joules_low", ColumnUnit::Joules, lows),
                    real("joules_high", ColumnUnit::Joules, highs),
                ],
            },
            axes: vec![axis("bits", true, &["1", "2", "4"]), axis("word", false, &["z", NASTY])],
            figures: Figures {
                x: "bits".into(),
                y: "score".into(),
                series: Some("word".into()),
                panel: None,
                heat: Some(["bits".into(), "word".into()]),
                cost: Some("joules".into()),
                baseline: None,
                published: vec![],
            },
            refused: vec![Refused { point: 13, what: NASTY.into(), why: NASTY.into() }],
            notes: vec![NASTY.into()],
            learning: Learning::default(),
        }
    }

    fn view(&self) -> SweepView<'_> {
        SweepView {
            name: "name",
            title: NASTY,
            about: "One.\n\n<Two>.",
            table: &self.table,
            axes: &self.axes,
            figures: self.figures.clone(),
            refused: &self.refused,
            not_simulated: &self.notes,
            learning: &self.learning,
            version: "0.0.0",
        }
    }

    /// Every cell of a result gone.
    fn hollow() -> Self {
        let mut sample = Self::new();
        for column in &mut sample.table.columns {
            if let Values::Real(values) = &mut column.values {
                values.iter_mut().for_each(|value| *value = None);
            }
        }
        sample
    }
}

#[test]
fn text_of_the_table_cannot_end_or_start_anything_on_the_page() {
    for sample in [Sample::new(), Sample::hollow()] {
        let page = html(&sample.view());
        assert!(!page.contains(NASTY) && !page.contains("<Two>"));
        assert_eq!((page.matches("<script").count(), page.matches("</script>").count()), (4, 4));
        assert!(page.contains("<p>One.</p><p>&lt;Two&gt;.</p>"));
        assert!(page.contains("dalean verify STORE --sample N"));
    }
}

#[test]
fn the_best_setting_is_the_best_mean_among_those_with_most_runs() {
    let sample = Sample::new();
    let view = sample.view();
    let settings = Settings::new(&view);
    assert_eq!((settings.groups.len(), settings.finished()), (6, 11));
    let measure = settings.measure("score").unwrap();
    let (rows, best) = settings.best(measure).unwrap();
    assert_eq!((rows, best.n), ([8, 9].as_slice(), 2), "the other setting with 4 bits has one run");
    let cheapest = settings.best(settings.measure("joules").unwrap()).unwrap();
    assert_eq!(cheapest.0, [0, 1], "less energy is better");
    assert!(html(&view).contains("90.50<small>"));
}

#[test]
fn numbers_beyond_a_scripts_are_words_and_missing_cells_are_null() {
    let sample = Sample::new();
    let view = sample.view();
    let text = json::data(&Settings::new(&view));
    assert!(text.contains("9223372036854775807") && !text.contains('<'));
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(data["columns"][2]["words"][0], "9223372036854775807");
    assert_eq!(
        data["columns"][1]["codes"],
        serde_json::json!([0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1])
    );
    assert!(data["columns"][3]["values"][11].is_null());
    assert_eq!(data["columns"][3]["values"][0], 0.6);
}

#[test]
fn the_page_is_given_what_it_would_have_to_compute() {
    let sample = Sample::new();
    let view = sample.view();
    let data: serde_json::Value = serde_json::from_str(&json::data(&Settings::new(&view))).unwrap();
    assert_eq!(data["setting"], serde_json::json!([0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]));
    let score = &data["columns"][3];
    assert_eq!(score["n"], serde_json::json!([2, 2, 2, 2, 2, 1]));
    assert_eq!((&score["mean"][0], &score["mean"][5]), (&0.605.into(), &0.9.into()));
    // t is 12.706 and s / sqrt(2) is 0.005; one run has no interval
    assert!((score["half"][0].as_f64().unwrap() - 0.063_531).abs() < 1e-6);
    assert!(score["half"][5].is_null());
    assert_eq!((&score["title"], &score["by"]), (&"score (%)".into(), &100.0.into()));
    assert_eq!(
        data["columns"][0]["marks"],
        serde_json::json!([[1.0, "1"], [2.0, "2"], [4.0, "4"]])
    );
    assert_eq!(data["axes"][1]["codes"], serde_json::json!([0, 1, 0, 1, 0, 1]));
    assert_eq!(data["best"], 4);
    // joules rise with the score: of each two settings with one score the first is on the front
    assert_eq!(data["fronts"]["joules"]["score"], serde_json::json!([0, 2, 5, 4]));
    assert_eq!(data["fronts"]["score"]["joules"], serde_json::json!([0]));
}

#[test]
fn values_too_many_to_tell_apart_go_into_ranges() {
    let mut sample = Sample::new();
    let rates: Vec<f64> = (0..100).map(|at| 10f64.powf(f64::from(at) / 33.0)).collect();
    sample.table.columns = vec![
        column(
            "rate",
            ColumnUnit::Plain,
            Role::Axis,
            Values::Real(rates.into_iter().map(Some).collect()),
        ),
        column("score", ColumnUnit::Fraction, Role::Result, Values::Real(vec![Some(0.5); 100])),
    ];
    sample.axes = vec![ShownAxis { log: true, ..axis("rate", true, &[]) }];
    let view = sample.view();
    let settings = Settings::new(&view);
    let (ranges, places) = settings.axes[0].ranges();
    assert_eq!((ranges.len(), places[0], places[99]), (16, 0, 15));
    assert!(places.windows(2).all(|pair| pair[0] <= pair[1]), "in order");
    assert_eq!((&ranges[0][0], &ranges[15][1]), (&"1".to_owned(), &"1000".to_owned()));
    let data: serde_json::Value = serde_json::from_str(&json::data(&settings)).unwrap();
    assert_eq!(
        (&data["axes"][0]["binned"], &data["axes"][0]["numbers"]),
        (&true.into(), &serde_json::Value::Null)
    );
    assert!(data["columns"][1]["mean"].is_null(), "of one run each, the cells say it");
}

#[test]
fn figures_for_papers_stand_alone() {
    let sample = Sample::new();
    let drawn = figures(&sample.view());
    let names: Vec<&str> = drawn.iter().map(|figure| figure.name.as_str()).collect();
    assert_eq!(names, ["curves", "heat", "pareto", "importance"]);
    for figure in &drawn {
        let svg = &figure.svg;
        assert!(svg.starts_with("<svg xmlns=") && svg.contains("fill=\"#fff\"/>"));
        for bad in ["NaN", "inf", "var(", "http:", "</script", "url(h", "url(\""] {
            assert!(
                !svg.replace("xmlns=\"http://www.w3.org/2000/svg\"", "").contains(bad),
                "{bad}"
            );
        }
        let unit = if figure.name == "importance" { "variance of score" } else { "score (%)" };
        assert!(svg.contains(unit), "{} has its unit", figure.name);
        // A picture of a column's width at about 300 dots an inch.
        let picture = png(svg);
        let reader = png::Decoder::new(std::io::Cursor::new(&picture)).read_info().unwrap();
        assert!((1000..=2600).contains(&reader.info().width), "{}", reader.info().width);
        assert_eq!(picture, png(svg), "the same bytes again");
    }
    assert!(drawn[0].svg.contains("n = 1 to 2 runs"));
    let bits =
        |svg: &str| ["1", "2", "4"].iter().all(|bit| svg.contains(&format!(">{bit}</text>")));
    assert!(bits(&drawn[0].svg) && bits(&drawn[1].svg), "every value has its mark");
    assert!(figures(&Sample::hollow().view()).is_empty());
    assert!(png("no svg").is_empty());
}

#[test]
fn learning_curves_are_drawn_where_records_have_several_epochs() {
    let mut sample = Sample::new();
    let climb = |row: usize| vec![(0, 0.1), (1, 0.4 + 0.01 * row as f64), (2, 0.8)];
    sample.learning = Learning {
        label: "validation accuracy".into(),
        shares: true,
        rows: (0..12).map(climb).collect(),
    };
    let drawn = figures(&sample.view());
    let learning = drawn.iter().find(|figure| figure.name == "learning").unwrap();
    assert!(learning.svg.contains("validation accuracy (%)") && learning.svg.contains("epoch"));
    let data = json::data(&Settings::new(&sample.view()));
    let data: serde_json::Value = serde_json::from_str(&data).unwrap();
    assert_eq!(data["learning"]["epochs"], serde_json::json!([0, 1, 2]));
    assert_eq!(data["learning"]["settings"][0]["mean"], serde_json::json!([0.1, 0.405, 0.8]));
    assert_eq!(data["learning"]["settings"][0]["n"], 2);
    // one epoch is no curve
    sample.learning.rows.iter_mut().for_each(|row| row.truncate(1));
    assert!(figures(&sample.view()).iter().all(|figure| figure.name != "learning"));
}

#[test]
fn an_axis_explains_as_much_of_the_variance_as_its_means_do() {
    use super::importance::importance;
    // bits 1 and 2 by two words by two seeds: the score is the bits and a little of the seed
    let mut sample = Sample::new();
    for column in &mut sample.table.columns {
        match &mut column.values {
            Values::Whole(values) => values.truncate(8),
            Values::Real(values) => values.truncate(8),
            Values::Text(values) => values.truncate(8),
        }
    }
    let view = sample.view();
    let settings = Settings::new(&view);
    let found = importance(&settings, settings.measure("score").unwrap()).unwrap();
    let share = |name: &str| found.parts.iter().find(|part| part.name == name).unwrap().share;
    // sums of squares: 8 x 0.05^2 between the bits, 8 x 0.005^2 between the seeds
    assert!((share("bits") - 0.02 / 0.0202).abs() < 1e-9, "{found:?}");
    assert!((share("seeds") - 0.0002 / 0.0202).abs() < 1e-9, "{found:?}");
    assert!(share("word").abs() < 1e-9 && share("axes together").abs() < 1e-9);
    assert!(found.balanced && found.runs == 8);
    assert!((found.parts[0].chance.unwrap() - 1.0 / 7.0).abs() < 1e-12);
    // the whole sample lacks a run: parts need not add up, and no remainder is told
    let sample = Sample::new();
    let view = sample.view();
    let settings = Settings::new(&view);
    let found = importance(&settings, settings.measure("score").unwrap()).unwrap();
    assert!(!found.balanced && found.parts.iter().all(|part| part.name != "axes together"));
    let hollow = Sample::hollow();
    let view = hollow.view();
    let settings = Settings::new(&view);
    assert_eq!(importance(&settings, settings.measure("score").unwrap()), None);
}

#[test]
fn letters_are_drawn() {
    let text = |words: &str| {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"90\" height=\"30\"><text y=\"20\" \
                   font-family=\"sans-serif\">";
        png(&format!("{svg}{words}</text></svg>"))
    };
    assert_ne!(text("µJ"), text(""));
    assert_ne!(text("µJ"), text("nJ"));
}

#[test]
fn the_table_for_the_terminal_has_means_and_intervals() {
    let sample = Sample::new();
    let text = text(&sample.view()).unwrap();
    let line = |start: &str| {
        let found = text.lines().find(|line| line.trim_start().starts_with(start));
        found.unwrap_or_else(|| panic!("no line {start} in\n{text}")).to_owned()
    };
    // two seeds, 0.60 and 0.61: t is 12.706, s / sqrt(2) is 0.005
    assert!(line("1 ").contains("60.50 ±6.35"), "{text}");
    assert!(line("4 ").contains("90.50 ±6.35"), "{text}");
    assert!(text.starts_with("score (%) against bits, mean of n = "), "{text}");
    let mut empty = Sample::new();
    empty.table.columns.retain(|column| column.name != "score");
    assert_eq!(super::text(&empty.view()), None);
}

//! Laws of the page: well formed, nothing that is no number, all text escaped, the records' own values.

use super::sample::Sample;
use super::{Picture, html, text};
use crate::lab::config::{CostClass, Kind};
use crate::lab::price::{
    Cost, EnergySplit, EnergyTotal, Group, Missing, PerPiece, PieceKind, Share,
};
use crate::lab::store::ledger::{CyclesRecord, LayerCycles, LedgerRecord};
use crate::lab::store::record::{ClassifyOutcome, Outcome, TestOutcome};

const DALE: &[&str] = &["pp", "np", "nn", "pn"];
const READOUT: &[&str] = &["pp", "np"];
const PAIR: &[&str] = &["e", "i"];

/// What a run might cost.
fn cost() -> Cost {
    let group = |name: &str, joules| Group { name: name.into(), joules };
    let missing = Missing {
        what: "holds".into(),
        count: Some(3),
        why: "<none>".into(),
        class: Some(CostClass::Converter),
        phases: vec!["training".into()],
    };
    let total = |joules, priced, parts| EnergyTotal { joules, priced, parts };
    let split =
        |class, joules, priced, parts| EnergySplit { class, total: total(joules, priced, parts) };
    let split = vec![
        split(CostClass::Converter, [1e-9, 1.5e-9, 5e-9], 1, 2),
        split(CostClass::Static, [0.0, 5e-10, 3e-9], 1, 1),
    ];
    Cost {
        cycles: Some(1_234_567),
        seconds: Some(0.001_234_567),
        energy: Some(total([1e-9, 2e-9, 8e-9], 2, 3)),
        per_piece: vec![PerPiece {
            phase: "training".into(),
            kind: PieceKind::Image,
            count: 1000,
            total: total([1e-12, 2e-12, 8e-12], 2, 3),
            split: split.clone(),
            seconds: Some(1.2e-6),
        }],
        split,
        sums_share: Some(0.3),
        scaled: vec![],
        components: vec![
            group("conversion", [1e-9, 1.5e-9, 5e-9]),
            group("tile_static", [0.0, 5e-10, 3e-9]),
        ],
        phases: vec![group("training", [1e-9, 2e-9, 8e-9])],
        operations: vec![group("forward_rows", [1e-9, 1.5e-9, 5e-9])],
        layers: vec![group("layer 0", [1e-9, 2e-9, 8e-9])],
        pathways: vec![group("pp", [1e-9, 2e-9, 8e-9])],
        constants: vec![Share { key: "energy.<x>_pj".into(), share: 0.75, kind: Kind::Fitted }],
        assumed_share: 0.25,
        missing: vec![missing],
        each: vec![("conversions", "conversion", 1e-13)],
    }
}

/// What a chip with a timing might have counted.
fn ledger() -> LedgerRecord {
    let named = |all: &[(&str, u64)]| all.iter().map(|&(name, n)| (name.to_owned(), n)).collect();
    let phase = |stages: &[(&str, u64)], layers: usize| CyclesRecord {
        elapsed: stages.iter().map(|(_, cycles)| cycles).sum(),
        stages: named(stages),
        layers: (0..layers)
            .map(|_| LayerCycles {
                busy: named(&[("forward_rows", 600_000), ("error", 0)]),
                used: named(&[("converters", 450_000), ("writers", 3)]),
            })
            .collect(),
    };
    let training = phase(&[("forward", 900_000), ("program", 100_000), ("error", 0)], 2);
    let evaluation = phase(&[("forward", 234_567)], 0);
    let phases = [("training".into(), training), ("evaluation".into(), evaluation)];
    LedgerRecord { counts: vec![], cycles: Some(phases.into()) }
}

/// Runs at the edges of what a report may meet.
fn samples() -> Vec<Sample> {
    let dense = || Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    let mut unfinished = dense();
    unfinished.receipt.test = None;
    unfinished.receipt.status = "running".into();
    unfinished.pictures.clear();
    unfinished.heats.clear();
    let mut empty = Sample::new(&[], 0, 0);
    empty.receipt.test = None;
    empty.config = "not = [toml".into();
    let mut hollow = dense();
    for record in &mut hollow.epochs {
        record.events.clear();
        let none = ClassifyOutcome { train: None, validation: None };
        record.outcome = Outcome::Classify(none);
        record.layers.iter_mut().for_each(|layer| layer.levels = [0, 0]);
        for one in &mut record.pathways {
            (one.cells, one.floor, one.zero, one.levels) = (0, 0, 0, 0);
            one.histogram.clear();
            one.training.clear();
        }
    }
    hollow.heats[0].levels.pop();
    hollow.pictures[0].values.pop();
    let mut priced = dense();
    (priced.cost, priced.ledger) = (Some(cost()), Some(ledger()));
    let mut timed = dense();
    timed.cost = Some(Cost { energy: None, components: vec![], each: vec![], ..cost() });
    timed.ledger = Some(ledger());
    let mut colour = Sample::new(&[(193, 4, DALE)], 2, 4);
    colour.pictures.remove(0);
    vec![
        dense(),
        unfinished,
        empty,
        hollow,
        colour,
        Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 1, 10),
        Sample::new(&[(9, 1, READOUT)], 2, 2),
        Sample::new(&[(64, 20, PAIR), (20, 1, PAIR)], 2, 1),
        Sample::new(&[(16, 256, READOUT)], 700, 256),
        Sample::new(&[(900, 3, DALE)], 2, 30),
        priced,
        timed,
    ]
}

/// Panics unless every tag that opens closes, in order; attributes are double-quoted and hold no `<`.
fn check_tags(page: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        let inside = &rest[start + 1..];
        let end = inside.find('>').expect("every < has its >");
        let tag = &inside[..end];
        rest = &inside[end + 1..];
        assert!(!tag.contains('<'), "unescaped text in <{tag}>");
        assert_eq!(tag.matches('"').count() % 2, 0, "quotes of <{tag}>");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if tag.starts_with('!') || tag.ends_with('/') || ["meta", "img", "input"].contains(&name) {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "nesting at </{name}>");
        } else {
            open.push(name);
            if name == "script" || name == "style" {
                rest = &rest[rest.find(&format!("</{name}")).expect("it closes")..];
            }
        }
    }
    assert_eq!(open, Vec::<&str>::new());
}

#[test]
fn every_page_is_well_formed_and_self_contained() {
    for sample in samples() {
        let page = html(&sample.view());
        check_tags(&page);
        let start = page.find("</style>").unwrap();
        let body = &page[start..page.find("<script>").unwrap()];
        // Encoded images may spell anything.
        let mut pieces = body.split("base64,");
        let mut words = pieces.next().unwrap().to_owned();
        pieces.for_each(|piece| words.push_str(&piece[piece.find('"').unwrap()..]));
        for bad in ["NaN", "inf ", "inf\"", "http:", "https:", "<one>", "<warning>"] {
            assert!(!words.contains(bad), "{bad} in {words}");
        }
    }
}

#[test]
fn the_page_shows_the_numbers_of_the_records() {
    let sample = Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    let page = html(&sample.view());
    let last = &sample.epochs[2];
    let wanted = [
        ("1749 / 1797", "97.33<small>"),
        ("right of how many", "1 749 of 1 797 right"),
        ("validation after epoch 2", "82.00 %"),
        ("updates", "154 updates"),
        ("cells on the floor", "<div class=\"value\">30.0 %</div>"),
        ("cells of all six pathways", "of 5 520 cells"),
        ("E/I of a layer", "<b>1.21</b>"),
        ("time", "12.3 s"),
        ("state", last.state_hash.as_str()),
        ("cells asked to change", "<td>8 000</td>"),
        ("bounded of requested", "<td>10.0 %</td>"),
        ("effective of attempted", "<td>80.2 %</td>"),
        ("saturated conversions in the last epoch", "<td>28</td>"),
        ("class name, escaped", "&lt;one&gt;"),
        ("title, escaped", "digits &amp; &quot;dales&quot;"),
        ("what is not simulated", "<td>a level stays</td><td>&lt;5 %</td>"),
        ("how to check", "dalean verify"),
    ];
    let page = page.replace('\u{202f}', " ");
    for (what, text) in wanted {
        assert!(page.contains(text), "{what}: {text}");
    }
}

#[test]
fn a_page_of_a_mid_sized_net_stays_small() {
    let sample = Sample::new(&[(784, 512, DALE), (512, 10, READOUT)], 20, 10);
    let page = html(&sample.view());
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
}

#[test]
fn summary_is_narrow_aligned_and_dashes_where_nothing_can_be_divided() {
    for sample in samples() {
        let table = text::summary(&sample.view());
        assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
        assert!(!table.contains("NaN") && !table.contains("inf"));
    }
    let sample = Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    expect_test::expect![[r#"
        layer     cells floor %  zero %    E/I  pulses effective bounded % adc sat  table  error   gate
        0  pp      1280    30.0    30.0   1.21    3000      2406      10.0      14      0      0      0
           np      1280    30.0    30.0           3000      2406      10.0      14      0      0      0
           nn      1280    30.0    30.0           3000      2406      10.0      14      0      0      0
           pn      1280    30.0    30.0           3000      2406      10.0      14      0      0      0
        1  pp       200    30.0    30.0   1.21    3000      2406      10.0      14      0      0      0
           np       200    30.0    30.0           3000      2406      10.0      14      0      0      0
        all        5520    30.0    30.0          12.0k      9624      10.0      56      0      0      0

        train        80.20 %  802 of 1000 right, while learning in epoch 2
        validation   82.00 %  82 of 100 right, after epoch 2
        test         97.33 %  1749 of 1797 right, after epoch 2 (best validation)
        beside this 1 effect of real chips is not simulated, 1 with figures of this one: see the report
        state       0000000000000000000000000000000000000000000000000000000000abcdf1
    "#]].assert_eq(&text::summary(&sample.view()));
    let hollow = &samples()[3];
    assert!(text::summary(&hollow.view()).lines().nth(1).unwrap().contains(" - "));
}

#[test]
fn what_a_run_cost_stands_on_page_and_terminal() {
    let mut sample = Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    (sample.cost, sample.ledger) = (Some(cost()), Some(ledger()));
    let page = html(&sample.view()).replace('\u{202f}', " ");
    for words in [
        "time on the chip",
        "1.23 ms",
        "energy on the chip",
        "tile static",
        // shares of the phases, of the stages of training, of the time of a part
        "<td>81.0 %</td>",
        "<td>19.0 %</td>",
        "<td>90.0 %</td><td>900 k</td><td>900 us</td><td>converters of layer 0, 50 %</td>",
        ">45.0 %</td>",
        "One update takes 6 493 cycles",
        // by component, and the constant it leans on
        "<td>1.00 nJ</td><td><b>1.50 nJ</b></td><td>5.00 nJ</td><td>75.0 %</td>",
        "energy.&lt;x&gt;_pj",
        "<b>25 %</b> leans on assumed constants",
        // what has no price makes it a bound
        "energy on the chip, at least",
        "at least <b>2.00 nJ</b> (2 of 3 parts priced)",
        "converter, at least",
        "<td>1 000</td><td>1.20 us</td><td><b>≥ 2.00 pJ</b></td>",
        "<b>30 %</b> is memory of the digital sums",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let text = text::summary(&sample.view());
    expect_test::expect![[r#"
        on the chip 1.23 M cycles, 1.23 ms, at least 2.00 nJ (1.00 nJ to 8.00 nJ), 2 of 3 parts priced
                    converter at least 75 %, static 25 %, 25 % assumed
                    30 % is memory of sums, 64 bits a product; online or replay spares it in dense layers
                    to learn from an image at least 2.00 pJ, 1.20 us
                    without a price: holds
        beside this 1 effect of real chips is not simulated, 1 with figures of this one: see the report
    "#]]
    .assert_eq(&text[text.find("on the chip").unwrap()..text.find("state ").unwrap()]);
}

#[test]
fn what_a_chip_does_not_say_is_not_on_the_page() {
    let has = |sample: &Sample, id: &str| html(&sample.view()).contains(&format!("id=\"{id}\""));
    let mut sample = Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    assert!(!has(&sample, "time") && !has(&sample, "energy"));
    assert!(!html(&sample.view()).contains("on the chip"));
    // energies, but no timing
    sample.ledger = Some(LedgerRecord { cycles: None, ..ledger() });
    sample.cost = Some(Cost { cycles: None, seconds: None, ..cost() });
    assert!(!has(&sample, "time") && has(&sample, "energy"));
    // the reverse
    sample.ledger = Some(ledger());
    sample.cost = Some(Cost { energy: None, ..cost() });
    assert!(has(&sample, "time") && !has(&sample, "energy"));
}

#[test]
fn wrong_answers_stand_with_their_confusion_the_most_frequent_first() {
    let mut sample = Sample::new(&[(64, 20, DALE)], 2, 4);
    let Some(TestOutcome::Classify(test)) = &mut sample.receipt.test else { panic!("a test") };
    (test.confusion[2][3], test.confusion[1][0]) = (9, 5);
    assert_eq!(test.confusions()[..3], [(9, 2, 3), (5, 1, 0), (1, 0, 1)]);
    let one = sample.pictures[0].clone();
    let of = |example, truth, guess| Picture { example, truth, guess, ..one.clone() };
    sample.pictures = (1..=5).map(|example| of(example, 1, 0)).collect();
    sample.pictures.extend([of(6, 2, 3), of(7, 3, 2)]);
    let page = html(&sample.view());
    let start = page.find("id=\"mistakes\"").unwrap();
    let figure = &page[start..start + page[start..].find("</section>").unwrap()];
    let order: Vec<_> =
        figure.match_indices("<small>#").map(|(at, _)| &figure[at + 8..at + 9]).collect();
    // of a confusion at most four, the others at the end
    assert_eq!(order, ["6", "1", "2", "3", "4", "5", "7"]);
    let names = figure.matches("class=\"pair-name\"").count();
    assert_eq!(names, 2, "{names}");
}

#[test]
fn a_run_without_its_states_still_shows_levels_by_their_number() {
    let mut sample = Sample::new(&[(64, 20, DALE), (20, 10, READOUT)], 3, 10);
    sample.heats.clear();
    let page = html(&sample.view());
    assert!(page.contains("id=\"levels\"") && page.contains("level 3&#10;now 70.0"));
    assert!(!page.contains("id=\"maps\"") && !page.contains("id=\"fields\""));
}

//! Invented records for the tests of this room.

use std::collections::BTreeMap;

use super::{Heat, Picture, RunView};
use crate::lab::config::Absent;
use crate::lab::price::Cost;
use crate::lab::store::ledger::LedgerRecord;
use crate::lab::store::record::{
    ClassifyOutcome, DataRecord, EpochRecord, LayerRecord, Outcome, Receipt, Score, TestOutcome,
    TestRecord, TimingRecord,
};
use crate::learn::statistics::PathwayRecord;

/// An invented run: layers as rows, columns and names of pathways.
pub(super) struct Sample {
    pub config: String,
    pub receipt: Receipt,
    pub epochs: Vec<EpochRecord>,
    pub heats: Vec<Heat>,
    pub pictures: Vec<Picture>,
    pub class_names: Vec<String>,
    pub ledger: Option<LedgerRecord>,
    pub cost: Option<Cost>,
    pub timing: TimingRecord,
    pub warnings: Vec<String>,
    pub absent: Vec<Absent>,
}

impl Sample {
    /// A run of `epochs` epochs, epoch 0 included, with a test of `classes` classes.
    pub(super) fn new(layers: &[(usize, usize, &[&str])], epochs: u32, classes: usize) -> Self {
        let records: Vec<_> = (0..epochs).map(|epoch| record(layers, epoch)).collect();
        let heats = layers.iter().enumerate().flat_map(|(layer, &(rows, columns, names))| {
            names.iter().map(move |name| heat(layer, name, rows, columns))
        });
        Self {
            config: "task = \"classify\"\n".into(),
            receipt: receipt(&records, classes),
            epochs: records,
            heats: heats.collect(),
            pictures: vec![picture(1), picture(3)],
            class_names: vec!["zero".into(), "<one>".into()],
            ledger: None,
            cost: None,
            timing: TimingRecord {
                version: "0.1.0".into(),
                kernel: "scalar".into(),
                threads: 2,
                epoch_seconds: vec![0.0, 12.3],
                steps_per_second: vec![],
            },
            warnings: vec!["a <warning>".into()],
            absent: vec![Absent {
                effect: "drift".into(),
                real: Some("levels that drift"),
                instead: Some("a level stays"),
                chip: Some("<5 %".into()),
            }],
        }
    }

    pub(super) fn view(&self) -> RunView<'_> {
        RunView {
            title: "digits & \"dales\"".into(),
            config: &self.config,
            receipt: &self.receipt,
            data: "digits".into(),
            timing: &self.timing,
            warnings: &self.warnings,
            absent: &self.absent,
            epochs: &self.epochs,
            level_max: 15,
            heats: &self.heats,
            pictures: &self.pictures,
            inputs: &[],
            window: None,
            film: None,
            class_names: &self.class_names,
            ledger: self.ledger.as_ref(),
            cost: self.cost.as_ref(),
        }
    }
}

fn heat(layer: usize, name: &str, rows: usize, columns: usize) -> Heat {
    let levels = (0..rows * columns).map(|cell| (cell * 37 % 61 % 16) as u16).collect();
    Heat { layer, pathway: name.into(), rows, columns, levels }
}

fn record(layers: &[(usize, usize, &[&str])], epoch: u32) -> EpochRecord {
    let e = u64::from(epoch);
    let counts = |scale: u64| -> BTreeMap<String, u64> {
        let names = [
            ("requested", 1000),
            ("bounded", 100),
            ("pulses_attempted", 1500),
            ("pulses_effective", 1203),
            ("conversions", 5000),
            ("saturated_conversions", 7),
        ];
        names.into_iter().map(|(name, each)| (name.into(), each * e * scale)).collect()
    };
    let mut pathways = Vec::new();
    for (layer, &(rows, columns, names)) in layers.iter().enumerate() {
        for name in names {
            let cells = (rows * columns) as u64;
            let floor = cells * (10 + e.min(20)) / 40;
            let mut histogram = vec![0; 16];
            (histogram[0], histogram[3]) = (floor, cells - floor);
            pathways.push(PathwayRecord {
                layer,
                pathway: (*name).into(),
                excites: matches!(*name, "pp" | "nn" | "e"),
                shape: [rows, columns],
                cells,
                floor,
                zero: floor,
                pruned: 0,
                births: e,
                deaths: 2 * e,
                levels: 3 * (cells - floor),
                idle: [[0, rows as u64], [0, columns as u64], [0, 1]],
                histogram,
                training: counts(1),
                wear: None,
            });
        }
    }
    let layers = (0..layers.len()).map(|layer| LayerRecord {
        layer,
        levels: [1200 + 3 * e, 1000],
        currents: [[300, 200], [100, 0]],
        adc_shifts: Vec::new(),
        rate_shift: 4,
        mute: Some(false),
    });
    EpochRecord {
        epoch,
        updates: 77 * e,
        outcome: Outcome::Classify(ClassifyOutcome {
            train: (epoch > 0).then_some(Score { correct: 800 + e, total: 1000 }),
            validation: Some(Score { correct: 80 + e, total: 100 }),
        }),
        state_hash: format!("{:064x}", 0xabcdef + e),
        layers: layers.collect(),
        pathways,
        events: [("evaluation".into(), counts(1)), ("training".into(), counts(4))].into(),
        cycles: Some([("training".to_owned(), 9000 * e)].into()),
        #[cfg(feature = "grown")]
        grown: 0,
    }
}

fn receipt(records: &[EpochRecord], classes: usize) -> Receipt {
    let confusion = (0..classes)
        .map(|truth| (0..classes).map(|guess| if truth == guess { 41 } else { 1 }).collect())
        .collect();
    let test = TestRecord {
        epoch: records.last().map_or(0, |record| record.epoch),
        select: "best_validation".into(),
        score: Score { correct: 1749, total: 1797 },
        confusion,
        mistakes: vec![[17, 1, 0]],
        confused: vec![[18, 0, 1]],
    };
    Receipt {
        arithmetic: 2,
        status: "finished".into(),
        run: "a0".into(),
        config: "c0".into(),
        data: DataRecord {
            hash: "d0".into(),
            examples: [1000, 100, 1797],
            features: 64,
            full_scale: 16,
            classes,
            image: None,
            names: vec![],
            middles: vec![],
        },
        tables: "e0".into(),
        metrics: "f0".into(),
        ledger: Some("b0".into()),
        checkpoint: "90".into(),
        best: None,
        states: true,
        epoch_hashes: records.iter().map(|record| record.state_hash.clone()).collect(),
        test: Some(TestOutcome::Classify(test)),
        notes: vec![],
        rates: vec![],
    }
}

fn picture(channels: usize) -> Picture {
    let values = (0..64 * channels).map(|i| (i % 17) as u8).collect();
    Picture {
        example: 17,
        truth: 1,
        guess: 0,
        height: 8,
        width: 8,
        channels,
        full_scale: 16,
        values,
    }
}

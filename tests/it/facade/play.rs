//! Any bytes as calls of the public face: what comes back is a result or an error that can be shown, never a panic.
//!
//! Used by the property of tests/it/facade.rs and by the fuzz target of the same name. Only names of the face are used.
//! Sizes stay small where memory and time follow them; elsewhere any number is tried.

use std::fmt::Display;
use std::num::NonZeroU32;

use dalean::hardware::{
    Adc, AdcBits, AdcRange, CellSpec, DigitalSpec, DitherBits, DitherPattern, DriveBits, DriveSpec,
    ErrorBits, FloorKind, IncrementMax, LevelBits, LutBits, PulseCode, ResidualBits, SliceTime,
    SliceTimes, Subtract, TileSpec, Timing, Window, WriteScheme, WriteSpec,
};
use dalean::network::{
    Activation, Augment, Batch, Centre, Coding, Control, Decay, DrivenBy, Gain, Homeostasis,
    InitialLevels, LayerSpec, Optimiser, OutputError, Pool, Positive, RateMantissa, Route, Rule,
    UpdateMode, Wiring,
};
use dalean::{
    Backend, Classifier, Config, Data, DataRoot, Examples, Experiment, Hardware, HardwareSpec,
    ImageShape, Machine, NetworkSpec, Session, Sources, Split,
};

const CONTROLS: [Control; 3] = [Control::FrozenHidden, Control::SameSign, Control::SameSignHidden];

#[path = "device.rs"]
mod device;
#[path = "outside.rs"]
mod outside;

/// What bytes are turned into; zeros follow the last one.
struct Choices<'a>(&'a [u8]);

impl Choices<'_> {
    fn byte(&mut self) -> u8 {
        let (first, rest) =
            self.0.split_first().map_or((0, self.0), |(first, rest)| (*first, rest));
        self.0 = rest;
        first
    }

    fn word(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    fn one_in(&mut self, n: u8) -> bool {
        self.byte() % n == n - 1
    }

    fn of<T: Clone>(&mut self, choices: &[T]) -> T {
        choices[usize::from(self.byte()) % choices.len()].clone()
    }

    /// A number of a range, one of its neighbours now and then, or any at all.
    fn near(&mut self, min: i64, max: i64) -> i64 {
        match self.byte() {
            255 => min - 1,
            254 => max.saturating_add(1),
            253 => self.word() as i64,
            248..=252 => max,
            _ => {
                let span = (max - min).unsigned_abs() + 1;
                min + (u64::from(self.byte()) << 8 | u64::from(self.byte())).rem_euclid(span) as i64
            }
        }
    }

    fn size(&mut self, min: usize, max: usize) -> usize {
        match self.byte() {
            255 => 0,
            254 => usize::MAX,
            253 => 1 << 40,
            _ => min + usize::from(self.byte()) % (max - min + 1),
        }
    }
}

/// A checked number, or `otherwise` once its refusal has been shown.
fn or<T, E: Display>(found: Result<T, E>, otherwise: T) -> T {
    found.unwrap_or_else(|error| {
        shown(&error);
        otherwise
    })
}

fn shown(error: &impl Display) {
    assert!(!error.to_string().is_empty(), "an error says something");
}

/// The same with slices of their own, mostly as many as a drive code has.
fn unequal(c: &mut Choices<'_>, timing: Timing) -> Timing {
    let first = SliceTime { settle: timing.settle, convert: timing.convert };
    let slices = (0..c.size(0, 9)).map(|at| match at {
        0 => first,
        _ => SliceTime {
            settle: c.near(1, 200_000_000) as u64,
            convert: c.near(1, 100_000_000) as u64,
        },
    });
    let slices: Vec<_> = slices.take(1 << 10).collect();
    let slices = or(SliceTimes::new(&slices).map(Some), None);
    Timing { slices, ..timing }
}

fn hardware(c: &mut Choices<'_>) -> Hardware {
    let reference = Hardware::reference();
    if c.one_in(4) {
        return reference;
    }
    let base = reference.clone().into_spec();
    let level_bits = or(LevelBits::new(c.near(1, 12)), base.cell.level_bits);
    let top = i64::from(level_bits.level_max());
    let window = Window::new(c.near(0, top / 2), c.near(top / 2 + 1, top), level_bits);
    let window = or(window, Window::new(0, top, level_bits).expect("the whole range"));
    let adc = match c.byte() % 3 {
        0 => Adc::Ideal,
        _ => Adc::Finite {
            bits: or(AdcBits::new(c.near(2, 16)), AdcBits::new(8).expect("inside")),
            subtract: c.of(&[Subtract::Digital, Subtract::Current]),
            range: match c.byte() % 4 {
                0 => AdcRange::Full,
                1 => AdcRange::Tracking,
                2 => AdcRange::Shift(c.near(0, 40) as u32),
                _ => AdcRange::Calibrated {
                    headroom: c.near(0, 16) as u32,
                    every_epoch: c.one_in(2),
                },
            },
        },
    };
    let timing = c.one_in(3).then(|| Timing {
        clock_khz: c.near(1, 1_000_000) as u64,
        beat: c.near(1, 1_000_000) as u64,
        settle: c.near(1, 200_000_000) as u64,
        convert: c.near(1, 100_000_000) as u64,
        share: c.near(1, 32_768) as u64,
        overlapped: c.one_in(2),
        lanes: c.near(1, 32_768) as u64,
        hops: c.near(0, 1_000_000) as u64,
        pulse: c.near(1, 100_000_000) as u64,
        pulse_code: c.of(&[PulseCode::Unary, PulseCode::Amplitude]),
        verify: c.one_in(2),
        active_max: c.one_in(2).then(|| c.near(1, 65_536) as u64),
        slices: None,
    });
    let timing = timing.map(|timing| if c.one_in(3) { unequal(c, timing) } else { timing });
    let trains = c.one_in(4);
    let mut spec = HardwareSpec {
        cell: CellSpec {
            level_bits,
            window,
            floor_kind: c.of(&[FloorKind::Recoverable, FloorKind::Absorbing]),
        },
        tile: TileSpec {
            rows: c.size(1, 80),
            columns: c.size(1, 80),
            count_max: c.one_in(4).then(|| c.size(1, 255)),
            transposed_read: c.one_in(2),
        },
        drive: DriveSpec {
            bits: or(DriveBits::new(c.near(1, 8)), base.drive.bits),
            dac_bits: c.near(1, 8) as u32,
        },
        adc,
        digital: DigitalSpec {
            lut_bits: or(LutBits::new(c.near(2, 14)), base.digital.lut_bits),
            error_bits: or(ErrorBits::new(c.near(2, 9)), base.digital.error_bits),
        },
        write: WriteSpec {
            increment_max: or(IncrementMax::new(c.near(1, 127)), base.write.increment_max),
            dither_bits: c.of(&[DitherBits::Zero, DitherBits::Eight, DitherBits::Sixteen]),
            dither_pattern: c.of(&[DitherPattern::PerCell, DitherPattern::Separable]),
            residual_bits: match trains {
                true => base.write.residual_bits,
                false => or(ResidualBits::new(c.near(0, 15)), base.write.residual_bits),
            },
            scheme: match trains {
                true => WriteScheme::Trains { slots_log2: c.near(0, 6) as u32 },
                false => WriteScheme::Rounded,
            },
        },
        timing,
        ..base
    };
    let ideal = spec.clone();
    if c.one_in(2) {
        device::devices(c, &mut spec);
    }
    match Hardware::new(spec) {
        Ok(hardware) => hardware,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            or(Hardware::new(ideal), reference)
        }
    }
}

/// A number that stands for a rate or a width, most often a usual one.
fn positive(c: &mut Choices<'_>) -> Positive {
    let value = match c.byte() % 8 {
        0 => f64::from_bits(c.word()),
        1 => c.of(&[1e-6, 1e6, 0.0, f64::NAN]),
        _ => f64::from(c.byte()) / 8.0,
    };
    let found = Positive::new(value).unwrap_or(Positive::ONE);
    found.times(Positive::ONE).expect("what is in range stays there")
}

fn network(c: &mut Choices<'_>, inputs: usize, outputs: usize) -> NetworkSpec {
    let rule = c.of(&[Rule::Ed, Rule::Ed, Rule::Kaneko, Rule::Dfa, Rule::Bp]);
    let mut sides = vec![inputs];
    sides.extend((0..c.byte() % 3).map(|_| c.size(1, 20)));
    sides.push(if rule == Rule::Kaneko && outputs == 2 { 1 } else { outputs });
    let last = sides.len() - 2;
    let layers = (0..=last).map(|at| LayerSpec {
        inputs: if c.one_in(64) { c.size(1, 20) } else { sides[at] },
        units: sides[at + 1],
        wiring: match (rule.is_dalean(), at == last) {
            _ if c.one_in(64) => c.of(&[Wiring::Dual, Wiring::DualReadout, Wiring::Single]),
            (true, false) => Wiring::Dual,
            (true, true) => Wiring::DualReadout,
            (false, _) => Wiring::Single,
        },
        driven_by: match (at == 0) != c.one_in(64) {
            true if c.one_in(64) => DrivenBy::Signed,
            true => DrivenBy::Shared,
            false => DrivenBy::Streams,
        },
        activation: match c.byte() % 4 {
            0 => Activation::Relu,
            1 => Activation::Identity,
            _ => Activation::Sigmoid(positive(c)),
        },
        weight_max_log2: c.near(-8, 8) as i32,
        initial: InitialLevels::Uniform {
            gain_64ths: [c.near(1, 1024) as u32, c.near(1, 1024) as u32],
        },
        constant_row: c.one_in(2),
        convolution: None,
        copies: if c.one_in(64) { c.size(0, 9) } else { 1 },
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    });
    let layers: Vec<_> = layers.collect();
    let shift = c.one_in(4).then(|| c.near(0, 16) as u32);
    let route = match (rule, c.byte() % 5) {
        (Rule::Bp, _) => c.one_in(8).then_some(Route::RandomSparse),
        (Rule::Dfa, _) => Some(Route::RandomDense { shift }),
        (_, 0) => Some(Route::RandomSparse),
        (_, 1) => Some(Route::ScalarBroadcast),
        (_, 2) => Some(Route::RandomDense { shift }),
        _ => Some(Route::Modulo { taps: c.size(1, 4), shift }),
    };
    let batch = if c.one_in(8) { c.near(1, 4096) } else { i64::from(c.byte() % 16) + 1 };
    let rates = if c.one_in(32) { c.size(0, 3).min(9) } else { layers.len() };
    let mantissas = if c.one_in(32) { c.size(0, 3).min(9) } else { layers.len() };
    let count = if c.one_in(32) { c.size(0, 3).min(9) } else { layers.len() };
    let optimisers = [
        Optimiser::Plain,
        Optimiser::Sign { dead_zone: false },
        Optimiser::Sign { dead_zone: true },
    ];
    NetworkSpec {
        layers,
        rule,
        mode: c.of(&[UpdateMode::Accumulate, UpdateMode::Replay, UpdateMode::Online]),
        error: match c.one_in(8) {
            true => OutputError::Softmax { temperature: Positive::ONE },
            false => OutputError::OneVsAll,
        },
        centre: c.of(&[Centre::None, Centre::Batch, Centre::Running]),
        route,
        batch: or(Batch::new(batch), Batch::new(4).expect("inside")),
        mantissas: (0..mantissas)
            .map(|_| or(RateMantissa::new(c.near(1, 15)), RateMantissa::new(1).expect("inside")))
            .collect(),
        rates: (0..rates).map(|_| positive(c)).collect(),
        decay: c.of(&[Decay::Constant, Decay::Cosine, Decay::Linear]),
        optimisers: (0..count).map(|_| c.of(&optimisers)).collect(),
        centred: (0..count).map(|_| c.one_in(16)).collect(),
        control: if c.one_in(8) { c.of(&CONTROLS) } else { Control::None },
        refresh: if c.one_in(8) { NonZeroU32::new(c.word() as u32 % 3) } else { None },
    }
}

fn examples(c: &mut Choices<'_>, features: usize, classes: usize) -> Option<Examples> {
    let count = usize::from(c.byte() % 12);
    let full_scale = c.of(&[1u8, 255, 16, 3, 0]);
    let values = if c.one_in(16) { c.size(0, 30).min(30) } else { count * features.min(64) };
    let values = (0..values).map(|_| c.byte() % full_scale.saturating_add(1)).collect();
    let labels = (0..count).map(|_| c.byte() % classes.clamp(1, 255) as u8).collect();
    let features = if c.one_in(32) { c.size(0, 9) } else { features };
    let classes = if c.one_in(32) { c.size(0, 9) } else { classes };
    Examples::new(values, labels, features, full_scale, classes).map_err(|e| shown(&e)).ok()
}

/// A chip, a network, examples, and a classifier of them.
fn classify(c: &mut Choices<'_>) {
    let (features, classes) = (c.size(1, 12).min(40), c.size(1, 10).min(256));
    let hardware = hardware(c);
    let network = network(c, features, classes);
    if let Err(error) = network.rates_effective(&hardware) {
        shown(&error);
    }
    let augment = c.one_in(4).then(|| Augment {
        pixels: c.near(0, 3) as u32,
        height: c.size(1, 4),
        width: c.size(1, 4),
        channels: c.size(1, 1),
        flip: c.one_in(2),
    });
    let image = [c.size(1, 4), c.size(1, 4), c.size(1, 3)];
    let coding = c.of(&[
        Coding::Values,
        Coding::Values,
        Coding::Pixels { image },
        Coding::OnOff { image },
        Coding::White { image },
    ]);
    // a cosine is tabulated update by update
    let epochs = if network.decay == Decay::Constant { c.word() as u32 } else { c.byte().into() };
    let experiment = Experiment { seed: c.word(), hardware, network, epochs, coding, augment };
    let _ = experiment.updates_per_epoch(c.size(0, 9));
    let Some(train) = examples(c, features, classes) else { return };
    let _ = train.codes(experiment.hardware.drive.bits);
    let backend = c.of(&Backend::available());
    let mut classifier = match Classifier::new(experiment, &train, backend) {
        Ok(classifier) => classifier,
        Err(error) => return shown(&error),
    };
    for _ in 0..c.byte() % 4 {
        match c.byte() % 3 {
            0 => {
                let other = examples(c, features, classes).unwrap_or_else(|| train.clone());
                match classifier.evaluate(&other) {
                    Ok(found) => assert_eq!(found.predictions.len(), other.len()),
                    Err(error) => shown(&error),
                }
            }
            choice => {
                let mut updates = if choice == 1 { usize::MAX } else { c.size(0, 3) };
                let _ = classifier.learn(&mut |_| {
                    updates = updates.saturating_sub(1);
                    updates > 0
                });
            }
        }
    }
    let _ = classifier.epoch();
}

/// Settings of a run that stays small.
const SETTINGS: &[(&str, &[&str])] = &[
    ("network.hidden", &["[3]", "[]", "[8,8]", "[0]", "[1]", "3", "[70]"]),
    ("network.outputs", &["1", "2", "0", "3", "default"]),
    ("network.activation", &["relu", "identity", "sigmoid", "tanh", "[\"relu\"]"]),
    ("network.weight_max", &["1", "0.25", "256", "3", "-1", "nan"]),
    ("network.bias_rows", &["true", "false"]),
    ("network.alpha", &["0.1", "6", "1e-7", "1e6"]),
    ("learning.rule", &["ed", "kaneko", "dfa", "bp", "x"]),
    ("learning.mode", &["accumulate", "replay", "online"]),
    ("learning.centre", &["none", "batch", "running"]),
    ("learning.route", &["modulo", "random_sparse", "scalar_broadcast", "random_dense"]),
    ("learning.taps", &["1", "2", "4", "0", "-1"]),
    ("learning.batch", &["1", "2", "3", "4096", "0"]),
    ("learning.rate", &["20", "0.01", "1e6", "0", "inf"]),
    ("learning.decay", &["constant", "cosine"]),
    ("learning.epochs", &["0", "1", "2", "5"]),
    ("learning.train_on", &["train", "all"]),
    ("learning.select", &["last", "best_validation"]),
    ("learning.shift_pixels", &["0", "1", "9"]),
    ("hw.cell.level_bits", &["1", "2", "5", "12", "13"]),
    ("hw.cell.floor_kind", &["absorbing", "recoverable"]),
    ("hw.adc.bits", &["2", "6", "16", "\"ideal\""]),
    ("hw.adc.range", &["full", "tracking", "calibrated", "3"]),
    ("hw.adc.subtract", &["digital", "current"]),
    ("hw.tile.rows", &["1", "2", "64", "0"]),
    ("hw.tile.columns", &["1", "3", "64"]),
    ("hw.tile.count", &["1", "9"]),
    ("hw.tile.transposed_read", &["true", "false"]),
    ("hw.write.scheme", &["rank1", "rounded"]),
    ("hw.write.residual_bits", &["0", "4", "15"]),
    ("hw.write.increment_max", &["1", "127", "128"]),
    ("hw.timing.lanes", &["1", "0", "32768"]),
    ("data.set", &["xor", "parity3", "xor", "optdigit"]),
    ("seed", &["0", "9223372036854775807", "-1"]),
];

fn sources<'a>(settings: &'a [String], text: &'a str, seed: Option<u64>) -> Sources<'a> {
    let experiment = (!text.is_empty()).then_some(("fuzz", text));
    Sources { experiment, settings, seed, ..Sources::default() }
}

fn load(settings: &[String], text: &str, seed: Option<u64>) -> Option<Config> {
    let config = Config::load(&sources(settings, text, seed)).map_err(|e| shown(&e)).ok()?;
    let resolved = config.to_toml();
    let again = Config::load(&sources(&[], &resolved, None)).expect("what was resolved is valid");
    assert_eq!(again.to_toml(), resolved);
    let _ = (config.warnings(), config.rule_name(), config.data_name());
    Some(config)
}

/// Any text as configuration, and as settings.
fn configure(c: &mut Choices<'_>) {
    let seed = c.one_in(4).then(|| c.word());
    let cut = usize::from(c.byte()).min(c.0.len());
    let (settings, text) = c.0.split_at(cut);
    let (settings, text) = (String::from_utf8_lossy(settings), String::from_utf8_lossy(text));
    // a model is a file name: reading what is named there is not the subject here
    if settings.contains("model") || text.contains("model") {
        return;
    }
    let settings: Vec<String> = settings.lines().map(str::to_owned).collect();
    if let Some(config) = load(&settings, &text, seed) {
        let image = [c.size(1, 9), c.size(1, 9), c.size(1, 3)];
        if let Err(error) = config.experiment(c.size(1, 99), c.size(1, 20), Some(image)) {
            shown(&error);
        }
    }
}

/// A run in memory, with any checkpoints.
fn run(c: &mut Choices<'_>) {
    let mut settings = vec!["data.set=xor".to_owned(), "network.hidden=[3]".to_owned()];
    for _ in 0..c.byte() % 8 {
        let (key, values) = c.of(SETTINGS);
        settings.push(format!("{key}={}", c.of(values)));
    }
    let seed = c.one_in(8).then(|| c.word());
    let Some(config) = load(&settings, "", seed) else { return };
    let data = match c.byte() % 4 {
        0 => own(c),
        _ => Data::load(&config, &DataRoot::new("nowhere")).map_err(|e| shown(&e)).ok(),
    };
    let threads = c.of(&[1, 1, 1, 2, 0, 1025, usize::MAX]);
    let machine = Machine::new(c.of(&Backend::available()), threads).map_err(|e| shown(&e));
    let (Some(data), Ok(machine)) = (data, machine) else { return };
    let mut session = match Session::new(&config, data, machine) {
        Ok(session) => session,
        Err(error) => return shown(&error),
    };
    let mut kept = session.checkpoint();
    for _ in 0..c.byte() % 8 {
        match c.byte() % 8 {
            0 => {
                if let Ok(record) = session.start() {
                    let _ = session.note(&record);
                }
            }
            1 | 2 => {
                let mut updates = if c.one_in(2) { usize::MAX } else { c.size(0, 3) };
                let learnt = session.advance(&mut |_| {
                    updates = updates.saturating_sub(1);
                    updates > 0
                });
                if let Ok(Some((record, _))) = learnt {
                    let _ = session.note(&record);
                }
            }
            3 => drop(session.test()),
            4 => kept = session.checkpoint(),
            5 => {
                let state = session.restore(&kept);
                // epochs beyond the last are no state of this run
                assert!(state.is_ok() || session.epoch() >= config.epochs());
            }
            6 => {
                let mut bytes = kept.clone();
                let at = usize::from(c.byte()) * usize::from(c.byte()) % bytes.len();
                match c.byte() % 3 {
                    0 => bytes.truncate(at),
                    1 => bytes[at] ^= c.byte(),
                    _ => bytes = c.0.to_vec(),
                }
                if let Err(error) = session.restore(&bytes) {
                    shown(&error);
                }
            }
            _ => {
                if let Err(error) = session.updates(c.size(0, 3) as u64) {
                    shown(&error);
                }
            }
        }
        let _ = (session.warnings(), session.state_hash());
    }
}

/// Data of the caller's own.
fn own(c: &mut Choices<'_>) -> Option<Data> {
    let (features, classes) = (c.size(1, 6).min(40), c.size(1, 5).min(256));
    let train = examples(c, features, classes)?;
    let mut part =
        || if c.one_in(3) { examples(c, features, classes) } else { Some(train.clone()) };
    let (validation, test) = (part()?, part()?);
    let image = c.one_in(3).then(|| ImageShape {
        height: c.size(1, 3),
        width: c.size(1, 3),
        channels: c.size(1, 1),
    });
    Data::new("own", Split { train, validation, test }, image).map_err(|e| shown(&e)).ok()
}

/// Calls what the bytes say.
pub(super) fn play(bytes: &[u8]) {
    let mut c = Choices(bytes);
    match c.byte() % 8 {
        0 => configure(&mut c),
        4 => outside::policy(&mut c),
        1..=3 => run(&mut c),
        _ => classify(&mut c),
    }
}

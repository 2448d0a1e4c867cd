//! What the core was given, as a list of keys and words: what decides a result, and nothing else.
//!
//! No constants, names, sources or prose: correcting a citation makes no other run. A key whose value is its *frozen
//! default* is left out. That is the value a missing key had when the key was born, so a key that is added to the
//! program later changes no list of a run that does not use it. [`FROZEN`] is never edited, only added to: when what
//! users get by saying nothing changes, the key is written into the resolved configuration instead.

use std::num::NonZeroU32;

use super::{Config, ConfigError, Select, TrainOn};
use crate::chip::crossbar::kernel::ConvShape;
use crate::chip::hardware::{
    Adc, AdcRange, CellSpec, DigitalSpec, DitherBits, DitherPattern, DriveSpec, FloorKind,
    HardwareSpec, PulseCode, Subtract, TileSpec, Timing, WriteScheme, WriteSpec,
};
use crate::chip::layer::{DrivenBy, Gain, Homeostasis, InitialLevels, LayerSpec, Optimiser, Pool};
use crate::learn::error::{Centre, OutputError};
use crate::learn::network::NetworkSpec;
use crate::learn::route::Route;
use crate::learn::rule::{Control, Rule, UpdateMode};
use crate::num::tables::{Activation, Decay};
use crate::task::classify::{Augment, Coding, Experiment, WHITE_NAME};
use crate::task::policy::{Evaluating, Evolution, InputCoding, Method, PolicyExperiment, Ppo};

mod cells;

/// Frozen defaults: of keys of a layer under `layer`, whatever its number.
const FROZEN: &[(&str, &str)] = &[
    ("task", "classify"),
    ("seed", "1"),
    ("layer.wiring", "dual"),
    ("layer.activation", "sigmoid 6"),
    ("layer.weight_max_log2", "2"),
    ("layer.gain_64ths", "96 32"),
    ("layer.constant_row", "false"),
    ("layer.rate", "20"),
    ("learning.rule", "ed"),
    ("learning.mode", "accumulate"),
    ("learning.centre", "batch"),
    ("learning.route", "modulo 1"),
    ("learning.batch", "32"),
    ("learning.mantissa", "1"),
    ("learning.decay", "cosine"),
    ("learning.epochs", "20"),
    ("learning.shift_pixels", "0"),
    ("learning.train_on", "train"),
    ("learning.select", "best_validation"),
    ("cell.level_bits", "8"),
    ("cell.floor", "0"),
    ("cell.ceiling", "255"),
    ("cell.floor_kind", "recoverable"),
    ("tile.rows", "256"),
    ("tile.columns", "256"),
    ("tile.count", "any"),
    ("tile.transposed_read", "false"),
    ("drive.bits", "8"),
    ("drive.dac_bits", "8"),
    ("adc", "ideal"),
    ("digital.lut_bits", "10"),
    ("digital.error_bits", "8"),
    ("write.increment_max", "7"),
    ("write.dither_bits", "8"),
    ("write.dither_pattern", "per_cell"),
    ("write.residual_bits", "0"),
    ("write.scheme", "rounded"),
    ("timing.beat", "1"),
    ("timing.settle", "1"),
    ("timing.convert", "1"),
    ("timing.share", "1"),
    ("timing.overlapped", "false"),
    ("timing.lanes", "1"),
    ("timing.hops", "0"),
    ("timing.pulse", "1"),
    ("timing.pulse_code", "unary"),
    ("timing.verify", "false"),
    ("timing.active_max", "any"),
    ("timing.slices", "alike"),
    ("layer.mantissa", "1"),
    ("layer.optimiser", "plain"),
    ("layer.centred", "false"),
    ("learning.control", "none"),
    ("actor.control", "none"),
    ("critic.control", "none"),
    ("learning.refresh", "0"),
    ("actor.refresh", "0"),
    ("critic.refresh", "0"),
    ("ppo.noise_steps", "1"),
    ("layer.pool", "none"),
    ("layer.threshold", "false"),
    ("layer.gain", "table"),
    ("layer.homeostasis_window_log2", "9"),
    ("learning.error", "one_vs_all"),
    ("actor.error", "one_vs_all"),
    ("critic.error", "one_vs_all"),
    ("network.input", "values"),
    ("learning.flip", "false"),
    ("faults.floor", "0"),
    ("faults.ceiling", "0"),
    ("faults.any", "0"),
    ("read_noise.sigma", "0"),
    ("programming.sigma", "none"),
    ("faults.map", "none"),
    ("conductance.least", "0"),
    ("wires.segment", "0"),
    ("device.write_noise", "0"),
    ("device.tries", "4"),
    ("endurance", "none"),
    ("leakage", "none"),
    ("ageing", "none"),
    ("layer.copies", "1"),
];

/// Key and word.
type Given = (String, String);

impl Config {
    /// What the core is given for data of this shape, but the data: key and word, without frozen defaults.
    ///
    /// # Errors
    /// When the configuration does not fit such data.
    pub(crate) fn given(
        &self,
        features: usize,
        classes: usize,
        image: Option<[usize; 3]>,
    ) -> Result<Vec<(String, String)>, ConfigError> {
        if let Some(experiment) = self.policy_experiment()? {
            return Ok(policy(&experiment));
        }
        let experiment = self.experiment(features, classes, image)?;
        Ok(classify(&experiment, self.train_on, self.select))
    }
}

/// Everything a classification run was given, the data aside.
fn classify(experiment: &Experiment, train_on: TrainOn, select: Select) -> Vec<Given> {
    // without `..`, here and below: what a run is given is listed or does not compile
    let Experiment { seed, hardware, network, epochs, coding, augment } = experiment;
    let mut list = List::default();
    list.put("task", "classify");
    list.put("seed", seed);
    list.network("learning", 0, network);
    list.put("learning.epochs", epochs);
    let of = |[height, width, channels]: [usize; 3]| format!("of {height} x {width} x {channels}");
    list.put(
        "network.input",
        match *coding {
            Coding::Values => "values".into(),
            Coding::Pixels { image } => format!("pixels {}", of(image)),
            Coding::OnOff { image } => format!("on_off {}", of(image)),
            Coding::White { image } => format!("white ({WHITE_NAME}) {}", of(image)),
        },
    );
    let (mut shifts, mut flips) = ("0".to_owned(), "false".to_owned());
    if let Some(Augment { pixels, height, width, channels, flip }) = *augment {
        let image = of([height, width, channels]);
        if pixels > 0 {
            shifts = format!("{pixels} {image}");
        }
        if flip {
            flips = image;
        }
    }
    list.put("learning.shift_pixels", shifts);
    list.put("learning.flip", flips);
    list.put(
        "learning.train_on",
        match train_on {
            TrainOn::Train => "train",
            TrainOn::All => "all",
        },
    );
    list.put(
        "learning.select",
        match select {
            Select::BestValidation => "best_validation",
            Select::Last => "last",
        },
    );
    list.chip(hardware);
    list.0
}

/// Everything a policy was given.
fn policy(experiment: &PolicyExperiment) -> Vec<Given> {
    let PolicyExperiment {
        seed,
        hardware,
        environment,
        environments,
        input,
        actor,
        critic,
        method,
        steps,
        horizon,
        rollouts,
        evaluation,
    } = experiment;
    let Evaluating { episodes, episodes_final, deterministic } = evaluation;
    let mut list = List::default();
    list.put("task", "policy");
    list.put("seed", seed);
    list.put("environment.id", environment);
    list.put("environment.count", environments);
    list.put("environment.steps", steps);
    list.put("environment.horizon", horizon);
    list.put("environment.rollouts", rollouts);
    list.put(
        "network.input",
        match input {
            InputCoding::Split => "split",
            InputCoding::Offset => "offset",
            InputCoding::Signed => "signed",
        },
    );
    list.network("actor", 0, actor);
    match method {
        Method::Ppo(ppo) => {
            let Ppo {
                passes,
                discount,
                lambda,
                clip,
                entropy,
                log_sigma_start,
                log_sigma_rate,
                noise_steps,
            } = ppo;
            list.put("ppo.noise_steps", noise_steps);
            list.network("critic", actor.layers.len(), critic);
            list.put("ppo.passes", passes);
            // as the core has them: units of 2^-31
            for (name, share) in [
                ("ppo.gamma", discount),
                ("ppo.lambda", lambda),
                ("ppo.clip", clip),
                ("ppo.entropy", entropy),
                ("ppo.log_sigma_rate", log_sigma_rate),
            ] {
                list.put(name, share.to_bits());
            }
            list.put("ppo.log_sigma", log_sigma_start);
        }
        Method::Evolution(Evolution { pairs, step, shift }) => {
            list.put("es.pairs", pairs);
            list.put("es.step", step);
            list.put("es.shift", shift);
        }
    }
    list.put("evaluation.episodes", episodes);
    list.put("evaluation.final_episodes", episodes_final);
    list.put("evaluation.deterministic", deterministic);
    list.chip(hardware);
    list.0
}

#[derive(Default)]
struct List(Vec<Given>);

impl List {
    /// Puts a word down, unless it is the frozen default of its key.
    fn put(&mut self, key: &str, word: impl ToString) {
        let word = word.to_string();
        let (head, rest) = key.split_once('.').unwrap_or((key, ""));
        let kind = match head.strip_prefix("layer") {
            Some(_) => format!("layer.{rest}"),
            None => key.to_owned(),
        };
        let frozen = FROZEN.iter().find(|(name, _)| *name == kind);
        if frozen.is_none_or(|(_, default)| *default != word) {
            self.0.push((key.to_owned(), word));
        }
    }

    /// A network and how it learns, whose layers are numbered from `first`; what is no matter of one layer stands under
    /// `head`.
    fn network(&mut self, head: &str, first: usize, network: &NetworkSpec) {
        let NetworkSpec {
            layers,
            rule,
            mode,
            error,
            centre,
            route,
            batch,
            mantissas,
            rates,
            decay,
            optimisers,
            centred,
            control,
            refresh,
        } = network;
        for (number, (layer, rate)) in (first..).zip(layers.iter().zip(rates)) {
            self.layer(number, layer);
            self.put(&format!("layer{number}.rate"), rate.get());
        }
        for (number, (optimiser, centred)) in (first..).zip(optimisers.iter().zip(centred)) {
            let optimiser = match optimiser {
                Optimiser::Plain => "plain".to_owned(),
                Optimiser::Sign { dead_zone: false } => "sign".to_owned(),
                Optimiser::Sign { dead_zone: true } => "sign with a dead zone".to_owned(),
                Optimiser::Rms => "rms".to_owned(),
                Optimiser::Momentum { decay } => format!("momentum {decay}"),
                Optimiser::AdamFx { first_decay, second_decay } => {
                    format!("adam_fx {first_decay} {second_decay}")
                }
            };
            self.put(&format!("layer{number}.optimiser"), optimiser);
            self.put(&format!("layer{number}.centred"), centred);
        }
        let rule = match rule {
            Rule::Ed => "ed",
            Rule::Kaneko => "kaneko",
            Rule::Dfa => "dfa",
            Rule::EdNonDalean => "ed_non_dalean",
            Rule::Bp => "bp",
        };
        let mode = match mode {
            UpdateMode::Accumulate => "accumulate",
            UpdateMode::Replay => "replay",
            UpdateMode::Online => "online",
        };
        let centre = match centre {
            Centre::None => "none",
            Centre::Batch => "batch",
            Centre::Running => "running",
        };
        let shifted =
            |shift: &Option<u32>| shift.map_or(String::new(), |shift| format!(" >> {shift}"));
        let route = match route {
            None => "none".into(),
            Some(Route::Modulo { taps, shift }) => format!("modulo {taps}{}", shifted(shift)),
            Some(Route::RandomSparse) => "random_sparse".into(),
            Some(Route::ScalarBroadcast) => "scalar_broadcast".into(),
            Some(Route::RandomDense { shift }) => format!("random_dense{}", shifted(shift)),
        };
        let control = match control {
            Control::None => "none",
            Control::FrozenHidden => "frozen_hidden",
            Control::SameSignHidden => "same_sign_hidden",
            Control::SameSign => "same_sign",
        };
        self.put(&format!("{head}.control"), control);
        self.put(&format!("{head}.refresh"), refresh.map_or(0, NonZeroU32::get));
        self.put(&format!("{head}.rule"), rule);
        self.put(&format!("{head}.mode"), mode);
        let error = match error {
            OutputError::OneVsAll => "one_vs_all".to_owned(),
            OutputError::Softmax { temperature } => format!("softmax {}", temperature.get()),
        };
        self.put(&format!("{head}.error"), error);
        self.put(&format!("{head}.centre"), centre);
        self.put(&format!("{head}.route"), route);
        self.put(&format!("{head}.batch"), batch.get());
        // one of all layers has the name it had before there was one a layer
        match mantissas.first() {
            Some(one) if mantissas.iter().all(|other| other == one) => {
                self.put(&format!("{head}.mantissa"), one.get());
            }
            _ => {
                for (number, mantissa) in (first..).zip(mantissas) {
                    self.put(&format!("layer{number}.mantissa"), mantissa.get());
                }
            }
        }
        let decay = match decay {
            Decay::Constant => "constant",
            Decay::Cosine => "cosine",
            Decay::Linear => "linear",
        };
        self.put(&format!("{head}.decay"), decay);
    }

    fn layer(&mut self, number: usize, layer: &LayerSpec) {
        let LayerSpec {
            inputs,
            units,
            wiring,
            driven_by,
            activation,
            weight_max_log2,
            initial,
            constant_row,
            convolution,
            copies,
            pool,
            homeostasis,
        } = layer;
        let mut put = |key: &str, word: &dyn ToString| {
            self.put(&format!("layer{number}.{key}"), word.to_string());
        };
        put("inputs", inputs);
        put("units", units);
        put("wiring", &wiring.name());
        // data drive the first layer, activities every other one: there is no single frozen default
        match (number, driven_by) {
            (0, DrivenBy::Shared) | (1.., DrivenBy::Streams) => {}
            (_, DrivenBy::Signed) => put("driven_by", &"signed"),
            (0, DrivenBy::Streams) => put("driven_by", &"streams"),
            (1.., DrivenBy::Shared) => put("driven_by", &"shared"),
            (_, DrivenBy::Normalised) => put("driven_by", &"normalised"),
        }
        let activation = match activation {
            Activation::Sigmoid(alpha) => format!("sigmoid {}", alpha.get()),
            Activation::Relu => "relu".into(),
            Activation::Identity => "identity".into(),
            Activation::Rms => "rms".into(),
            Activation::Accumulator => "accumulator".into(),
            Activation::Ramp => "ramp".into(),
        };
        put("activation", &activation);
        put("weight_max_log2", weight_max_log2);
        match initial {
            InitialLevels::Uniform { gain_64ths: [e, i] } => put("gain_64ths", &format!("{e} {i}")),
            InitialLevels::AbsGaussian { gain: [n, d] } => {
                put("initial", &format!("abs_gaussian {n}/{d}"));
            }
        }
        put("constant_row", constant_row);
        if let Some(ConvShape { channels, height, width, side, stride, pad }) = convolution {
            let sizes = [channels, height, width, side, stride, pad].map(ToString::to_string);
            put("convolution", &sizes.join(" "));
        }
        put("copies", copies);
        match pool {
            Pool::None => put("pool", &"none"),
            Pool::Average { side } => put("pool", &format!("average {side}")),
            Pool::Max { side } => put("pool", &format!("max {side}")),
        }
        let Homeostasis { threshold, gain, window_log2 } = homeostasis;
        put("threshold", threshold);
        match gain {
            Gain::Table => put("gain", &"table"),
            Gain::Fixed { spread } => put("gain", &format!("fixed {spread}")),
            Gain::Tracking => put("gain", &"tracking"),
        }
        put("homeostasis_window_log2", window_log2);
    }

    fn chip(&mut self, hardware: &HardwareSpec) {
        let HardwareSpec {
            cell,
            tile,
            drive,
            adc,
            digital,
            write,
            device,
            timing,
            faults,
            fault_map,
            conductance,
            wires,
            read_noise,
            programming,
            endurance,
            leakage,
            ageing,
        } = hardware;
        let CellSpec { level_bits, window, floor_kind } = cell;
        let TileSpec { rows, columns, count_max, transposed_read } = tile;
        let DriveSpec { bits: drive_bits, dac_bits } = drive;
        let DigitalSpec { lut_bits, error_bits } = digital;
        let WriteSpec { increment_max, dither_bits, dither_pattern, residual_bits, scheme } = write;
        self.put("cell.level_bits", level_bits.get());
        self.put("cell.floor", window.floor());
        self.put("cell.ceiling", window.ceiling());
        let floor_kind = match floor_kind {
            FloorKind::Recoverable => "recoverable",
            FloorKind::Absorbing => "absorbing",
        };
        self.put("cell.floor_kind", floor_kind);
        self.put("tile.rows", rows);
        self.put("tile.columns", columns);
        self.put("tile.count", count_max.map_or("any".into(), |count| count.to_string()));
        self.put("tile.transposed_read", transposed_read);
        self.put("drive.bits", drive_bits.get());
        self.put("drive.dac_bits", dac_bits);
        match *adc {
            Adc::Ideal => self.put("adc", "ideal"),
            Adc::Finite { bits, subtract, range } => {
                self.put("adc", bits.get());
                let subtract = match subtract {
                    Subtract::Digital => "digital",
                    Subtract::Current => "current",
                };
                self.put("adc.subtract", subtract);
                let range = match range {
                    AdcRange::Shift(shift) => shift.to_string(),
                    AdcRange::Full => "full".into(),
                    AdcRange::Tracking => "tracking".into(),
                    AdcRange::Calibrated { headroom, every_epoch: false } => {
                        format!("calibrated + {headroom}")
                    }
                    AdcRange::Calibrated { headroom, every_epoch: true } => {
                        format!("calibrated + {headroom}, every epoch")
                    }
                };
                self.put("adc.range", range);
            }
        }
        self.put("digital.lut_bits", lut_bits.get());
        self.put("digital.error_bits", error_bits.get());
        self.put("write.increment_max", increment_max.get());
        let dither_bits: &DitherBits = dither_bits;
        self.put("write.dither_bits", dither_bits.get());
        let pattern = match dither_pattern {
            DitherPattern::PerCell => "per_cell",
            DitherPattern::Separable => "separable",
        };
        self.put("write.dither_pattern", pattern);
        self.put("write.residual_bits", residual_bits.get());
        let scheme = match scheme {
            WriteScheme::Rounded => "rounded".into(),
            WriteScheme::Trains { slots_log2 } => format!("rank1 {slots_log2}"),
        };
        self.put("write.scheme", scheme);
        if let Some(device) = device {
            self.device(device);
        }
        if let Some(timing) = *timing {
            self.timing(timing);
        }
        self.faults(*faults, fault_map);
        self.currents(*conductance, *wires);
        self.put("read_noise.sigma", read_noise.map_or(0, |noise| noise.sigma));
        self.loads(*programming);
        self.memory(*endurance, *leakage, *ageing);
    }

    /// The clock turns cycles into seconds and is read by no schedule: it is no part of what decides a run.
    fn timing(&mut self, timing: Timing) {
        let Timing {
            clock_khz: _,
            beat,
            settle,
            convert,
            share,
            overlapped,
            lanes,
            hops,
            pulse,
            pulse_code,
            verify,
            active_max,
            slices,
        } = timing;
        self.put("timing", "counted");
        self.put("timing.beat", beat);
        self.put("timing.settle", settle);
        self.put("timing.convert", convert);
        self.put("timing.share", share);
        self.put("timing.overlapped", overlapped);
        self.put("timing.lanes", lanes);
        self.put("timing.hops", hops);
        self.put("timing.pulse", pulse);
        let pulse_code = match pulse_code {
            PulseCode::Unary => "unary",
            PulseCode::Amplitude => "amplitude",
        };
        self.put("timing.pulse_code", pulse_code);
        self.put("timing.verify", verify);
        self.put("timing.active_max", active_max.map_or("any".into(), |cells| cells.to_string()));
        let each = slices.iter().flat_map(|own| own.iter());
        let each = each.map(|slice| format!("{} + {}", slice.settle, slice.convert));
        let each: Vec<_> = each.collect();
        self.put("timing.slices", if each.is_empty() { "alike".into() } else { each.join(", ") });
    }
}

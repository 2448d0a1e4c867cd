//! What is laid over a model: which of its settings and numbers are no longer its own.
//!
//! A physical number that `--set` gives is `assumed, by --set`, and so is one that a file gives without its source and mark. The
//! chip is called changed, and its summary says in what.

use std::collections::BTreeSet;

use toml::{Table, Value};

use super::check::wrong;
use super::file::HardwareFile;
use super::law::{Settings, kind_of, settings};
use super::{ConfigError, chip};

/// What is put behind the name of a model that is changed.
pub(super) const SUFFIX: &str = ", changed";

/// Tables of physical numbers.
const NUMBERS: [&str; 3] = ["energy", "power", "area"];

/// A model under a chip: what its numbers are for.
#[derive(Debug, Default)]
pub(super) struct UnderModel {
    /// Its settings; empty when it is no chip by itself.
    pub(super) settings: Settings,
    /// Keys of the chip that are not its own.
    pub(super) changed: Vec<String>,
}

/// Numbers of `hw` in a text: `conversion_pj = 1.4` as `--set` may say it becomes a table, and what does not say where it
/// comes from is assumed. `by` says who speaks; `always`: whatever is said, it is assumed.
pub(super) fn mark(over: &mut Table, by: &str, always: bool) {
    let Some(Value::Table(hw)) = over.get_mut("hw") else { return };
    if hw.contains_key("name") {
        return;
    }
    for table in NUMBERS {
        let Some(Value::Table(numbers)) = hw.get_mut(table) else { continue };
        for (_, number) in numbers.iter_mut() {
            let Value::Table(number) = number else { continue };
            let complete = number.contains_key("source") && number.contains_key("kind");
            if complete && !always {
                continue;
            }
            let source = match number.get("source").and_then(Value::as_str) {
                Some(source) => format!("by {by}: {source}"),
                None => format!("by {by}"),
            };
            number.insert("source".into(), Value::String(source));
            number.insert("kind".into(), Value::String("assumed".into()));
        }
    }
}

/// Bare numbers in place of physical ones, as tables whose bounds are the number itself; whether there were any.
pub(super) fn spread(over: &mut Table) -> bool {
    let Some(Value::Table(hw)) = over.get_mut("hw") else { return false };
    let mut any = false;
    for table in NUMBERS {
        let Some(Value::Table(numbers)) = hw.get_mut(table) else { continue };
        for (_, number) in numbers.iter_mut() {
            if matches!(number, Value::Float(_) | Value::Integer(_)) {
                let parts = ["low", "typical", "high"].map(|part| (part.into(), number.clone()));
                *number = Value::Table(Table::from_iter(parts));
                any = true;
            }
        }
    }
    any
}

/// Lays `own` keys over those of a model.
pub(super) fn lay(
    mut model: Table,
    file: &HardwareFile,
    own: Table,
) -> Result<(Table, UnderModel), ConfigError> {
    for (key, why) in [
        ("modes", "ways to use a chip are listed in its model file"),
        ("constants_for", "the program writes it beside a chip of its own"),
    ] {
        if own.contains_key(key) {
            let allowed = format!("{why}: remove the key");
            return Err(wrong(&format!("hw.{key}"), "is given", allowed));
        }
    }
    model.remove("modes");
    give_way(&mut model, &own);
    forget(&mut model, &own);
    let before = model.clone();
    super::overlay(&mut model, own);
    model.remove("model");
    let changed = differences(&before, &model);
    if !changed.is_empty() {
        let text = |key: &str| model.get(key).and_then(Value::as_str).unwrap_or_default();
        let name = format!("{}{SUFFIX}", text("name"));
        let summary = format!("{}; changed: {}", text("summary"), changed.join(", "));
        model.insert("name".into(), Value::String(name));
        model.insert("summary".into(), Value::String(summary));
    }
    let mut alone = file.clone();
    let own_settings = chip::resolve(&mut alone, "").map(|chip| settings(&chip, kind_of(&alone)));
    let mut settings = own_settings.unwrap_or_default();
    // a chip that was changed and saved says itself what its numbers are for
    settings.extend(file.constants_for.iter().flatten().map(|(key, value)| (*key, value.clone())));
    Ok((model, UnderModel { settings, changed }))
}

/// Another kind of converter takes other keys: those of the model's kind give way to it.
fn give_way(model: &mut Table, own: &Table) {
    let kind = own.get("adc").and_then(Value::as_table).and_then(|adc| adc.get("converter"));
    let Some(kind) = kind else { return };
    let now = model.get("adc").and_then(Value::as_table).and_then(|adc| adc.get("converter"));
    if now == Some(kind) {
        return;
    }
    if let Some(Value::Table(timing)) = model.get_mut("timing") {
        timing.remove("convert_cycles");
    }
    if let Some(Value::Table(adc)) = model.get_mut("adc") {
        adc.remove("step_cycles");
        adc.remove("phase_bits");
    }
}

/// A number that is given anew stands for the chip, whatever the model's stood for.
fn forget(model: &mut Table, own: &Table) {
    for table in NUMBERS {
        let (Some(Value::Table(numbers)), Some(Value::Table(given))) =
            (model.get_mut(table), own.get(table))
        else {
            continue;
        };
        for (key, number) in given {
            if number.get("typical").is_some()
                && let Some(Value::Table(number)) = numbers.get_mut(key)
            {
                number.remove("at");
            }
        }
    }
}

/// Keys whose values differ, prose and marks aside.
fn differences(before: &Table, after: &Table) -> Vec<String> {
    let mut found = Vec::new();
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    for key in keys {
        match (before.get(key), after.get(key)) {
            _ if ["name", "summary", "not_simulated", "node_nm"].contains(&key.as_str()) => {}
            (Some(Value::Table(before)), Some(Value::Table(after))) => {
                let inner: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
                let numbers = NUMBERS.contains(&key.as_str());
                let prose = |inner: &str| !numbers && ["source", "kind"].contains(&inner);
                let differ = inner.into_iter().filter(|inner| !prose(inner));
                let differ = differ.filter(|inner| before.get(*inner) != after.get(*inner));
                found.extend(differ.map(|inner| format!("{key}.{inner}")));
            }
            (before, after) if before != after => found.push(key.clone()),
            _ => {}
        }
    }
    found
}

/// Writes into a chip what its numbers are for: settings of the model that it has otherwise, and what stands for the chip
/// itself because it was given with it.
pub(super) fn settle(file: &mut HardwareFile, model: &UnderModel, chip: &Settings) {
    let other = |(setting, value): (&_, &_)| chip.get(setting) != Some(value);
    let others: Settings = model
        .settings
        .iter()
        .filter(|&pair| other(pair))
        .map(|(&setting, value)| (setting, value.clone()))
        .collect();
    if others.is_empty() {
        return;
    }
    let here: Settings =
        others.keys().filter_map(|key| Some((*key, chip.get(key)?.clone()))).collect();
    super::quantity::stand_here(file, &model.changed, &here);
    file.constants_for = Some(others);
}

#[cfg(test)]
mod tests {
    use super::super::{Config, CostTable, Kind, Sources, Standing, load};

    fn chip(model: &str, settings: &[&str]) -> Config {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let sources = Sources { hardware: Some(model), settings: &settings, ..Sources::default() };
        let config = load(&sources).unwrap_or_else(|error| panic!("{model} {settings:?}: {error}"));
        let text = config.to_toml();
        let again = Sources { experiment: Some(("resolved", &text)), ..Sources::default() };
        let again = load(&again).unwrap();
        assert_eq!(
            again.constants, config.constants,
            "a chip that was written down costs the same"
        );
        assert_eq!((again.to_toml(), again.hardware), (text, config.hardware.clone()));
        config
    }

    fn error(model: &str, settings: &[&str]) -> String {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let sources = Sources { hardware: Some(model), settings: &settings, ..Sources::default() };
        load(&sources).unwrap_err().to_string()
    }

    /// Picojoules of a conversion, if it has a price.
    fn conversion(config: &Config) -> Option<[f64; 3]> {
        let constant = config.constants.get(CostTable::Energy, "conversion").unwrap();
        let picojoules = constant.value.map(|joules| (joules * 1e15).round() / 1e3);
        constant.not_here().is_none().then_some(picojoules)
    }

    fn changed(config: &Config) -> Option<String> {
        let summary = config.resolved.hw.as_ref().unwrap().summary.clone().unwrap();
        assert_eq!(config.hardware_name.ends_with(super::SUFFIX), summary.contains("; changed: "));
        summary.split_once("; changed: ").map(|(_, keys)| keys.to_owned())
    }

    #[test]
    fn a_model_by_itself_is_not_changed_and_neither_is_one_that_is_told_its_own() {
        for settings in [&[][..], &["hw.adc.bits=6"], &["hw.tile.rows=128", "hw.adc.bits=6"]] {
            let config = chip("reram", settings);
            assert_eq!(config.hardware_name, "reram");
            assert_eq!(changed(&config), None);
            assert_eq!(conversion(&config), Some([0.3, 4.3, 34.5]));
        }
    }

    #[test]
    fn a_number_by_set_is_assumed_and_says_by_whom() {
        for (setting, value) in [
            ("hw.energy.conversion_pj=1.4", [1.4, 1.4, 1.4]),
            ("hw.energy.conversion_pj={ low = 1, typical = 2, high = 3 }", [1.0, 2.0, 3.0]),
            ("hw.energy.conversion_pj.typical=9", [0.3, 9.0, 34.5]),
            (
                "hw.energy.conversion_pj={ low = 1, typical = 2, high = 3, source = \"bench\", kind = \"measured\" }",
                [1.0, 2.0, 3.0],
            ),
        ] {
            let config = chip("reram", &[setting]);
            let constant = config.constants.get(CostTable::Energy, "conversion").unwrap();
            assert_eq!((conversion(&config), constant.kind), (Some(value), Kind::Assumed));
            assert!(constant.source.starts_with("by --set"), "{setting}: {}", constant.source);
            assert_eq!(changed(&config).as_deref(), Some("energy.conversion_pj"));
        }
        // a measured number of another table stays what it was
        let config = chip("reram", &["hw.energy.conversion_pj=1.4"]);
        assert_eq!(
            config.constants.get(CostTable::Energy, "cell_pulse").unwrap().kind,
            Kind::Measured
        );
        let wrong = error("reram", &["hw.energy.conversion_pj.typical=90"]);
        assert!(wrong.contains("low <= typical <= high"), "{wrong}");
    }

    #[test]
    fn a_file_that_cites_is_believed_and_one_that_does_not_is_assumed() {
        let of = |number: &str| {
            let text = format!("hw.model = \"reram\"\nhw.energy.conversion_pj = {{ {number} }}");
            let sources = Sources { experiment: Some(("mine.toml", &text)), ..Sources::default() };
            let config = load(&sources).unwrap();
            let constant = config.constants.get(CostTable::Energy, "conversion").unwrap().clone();
            (constant.kind, constant.source)
        };
        let number = "low = 1, typical = 2, high = 3";
        let cited = of(&format!("{number}, source = \"bench\", kind = \"measured\""));
        assert_eq!(cited, (Kind::Measured, "bench".into()));
        assert_eq!(of(number), (Kind::Assumed, "by mine.toml".into()));
    }

    #[test]
    fn a_constant_follows_its_law_or_is_not_priced() {
        let config = chip("reram", &["hw.adc.bits=8"]);
        assert_eq!(conversion(&config), Some([1.2, 17.2, 138.0]));
        let energy = config.constants.get(CostTable::Energy, "conversion").unwrap();
        let said = Standing::Scaled("walden, adc_bits 6 to 8: x 4".into());
        assert_eq!((&energy.standing, energy.kind), (&said, Kind::Assumed));
        let area = config.constants.get(CostTable::Area, "adc").unwrap();
        assert!((area.value[1] / (4.0 * 8300e-12) - 1.0).abs() < 1e-12);
        assert_eq!(config.hardware.timing.unwrap().convert, 9, "a step a bit and one more");
        assert_eq!(changed(&config).as_deref(), Some("adc.bits"));
        assert_eq!(chip("reram", &["hw.adc.bits=4"]).hardware.timing.unwrap().convert, 5);

        // a flash is no SAR of so many bits, and a lossless converter has none
        for settings in [&["hw.adc.converter=flash"][..], &["hw.adc=ideal"]] {
            let config = chip("reram", settings);
            assert_eq!(conversion(&config), None, "{settings:?}");
        }
        let flash = chip("reram", &["hw.adc.converter=flash", "hw.adc.step_cycles=2"]);
        assert_eq!(flash.hardware.timing.unwrap().convert, 2);
        // what was fitted to one point says nothing of another
        assert_eq!(conversion(&chip("hermes", &["hw.adc.bits=9"])), None);
        let ramp = chip("prime", &["hw.adc.bits=8"]);
        assert_eq!(
            (ramp.hardware.timing.unwrap().convert, conversion(&ramp).unwrap()[1]),
            (256, 5.04)
        );
        let pulse = |settings: &[&str]| {
            let config = chip("reram", settings);
            let pulse = config.constants.get(CostTable::Energy, "cell_pulse").unwrap().clone();
            pulse.not_here().is_none().then_some((pulse.value[1] * 1e15).round())
        };
        assert_eq!(pulse(&["hw.timing.pulse_cycles=100"]), Some(1400.0));
        // twice the clock and twice the cycles is the same pulse
        assert_eq!(pulse(&["hw.timing.pulse_cycles=100", "hw.timing.clock_mhz=2000"]), Some(700.0));
        assert_eq!(pulse(&["hw.cell.level_bits=4"]), None);
    }

    #[test]
    fn the_default_chip_has_a_price_for_every_width_and_kind_of_converter() {
        assert_eq!(conversion(&chip("ideal", &[])), Some([1.0, 10.0, 100.0]));
        assert_eq!(conversion(&chip("ideal", &["hw.adc.bits=8"])), Some([1.0, 10.0, 100.0]));
        assert_eq!(conversion(&chip("ideal", &["hw.adc.bits=6"])).unwrap()[1], 2.5);
        let sar = chip("ideal", &["hw.adc.bits=10", "hw.adc.converter=sar"]);
        assert_eq!(
            (conversion(&sar).unwrap()[1], sar.hardware.timing.unwrap().convert),
            (40.0, 11)
        );
        let ramp = chip("ideal", &["hw.adc.bits=10", "hw.adc.converter=ramp"]);
        assert_eq!(ramp.hardware.timing.unwrap().convert, 1024);
    }

    #[test]
    fn a_number_that_is_given_with_a_setting_is_for_that_setting() {
        let config = chip("reram", &["hw.adc.bits=8", "hw.energy.conversion_pj=7"]);
        let constant = config.constants.get(CostTable::Energy, "conversion").unwrap();
        assert_eq!((conversion(&config), &constant.standing), (Some([7.0; 3]), &Standing::Stated));
        // and the area, of which nothing was said, follows its law
        let area = config.constants.get(CostTable::Area, "adc").unwrap();
        assert!(matches!(area.standing, Standing::Scaled(_)));
        assert_eq!(changed(&config).as_deref(), Some("adc.bits, energy.conversion_pj"));
    }

    #[test]
    fn keys_of_another_kind_of_converter_give_way() {
        // neurram steps by 30 cycles; a fixed converter has no steps
        let fixed = chip("neurram", &["hw.adc.converter=fixed", "hw.timing.convert_cycles=300"]);
        assert_eq!(fixed.hardware.timing.unwrap().convert, 300);
        let refused = error("neurram", &["hw.timing.convert_cycles=300"]);
        assert!(refused.contains("a sar converter of 10 bits takes 11 steps"), "{refused}");
        let refused = error("reram", &["hw.constants_for.rows=3"]);
        assert!(refused.contains("hw.constants_for"), "{refused}");
    }

    #[test]
    fn laws_of_settings_that_a_quantity_does_not_belong_to_are_refused() {
        for (setting, wanted) in [
            ("hw.energy.hold_fj.scales=walden", "belongs to no setting"),
            (
                "hw.energy.conversion_pj.scales={ rows = \"linear\" }",
                "`conversion` belongs to adc_bits, converter",
            ),
            ("hw.energy.conversion_pj.at={ lut_bits = 3 }", "speaks of lut_bits"),
            ("hw.tile.kind=guess", "`hw.tile.kind` is \"guess\""),
            ("hw.adc.kind=sar", "adc.converter = \"sar\""),
            ("hw.energy.conversion_pj.scales=cubic", "a law (constant, linear, walden"),
        ] {
            let found = error("reram", &[setting]);
            assert!(found.contains(wanted), "{setting}: {found}");
        }
    }
}

//! Hardware models: the built-in ones, and files.

use super::file::HardwareFile;
use super::quantity::{Constants, constants_of};
use super::wrong::text_error;
use super::{ConfigError, chip};
use crate::chip::hardware::Hardware;
use crate::lab::near;

/// The built-in models, by name, as their files are.
macro_rules! models {
    ($folder:literal: $($name:literal)*) => {
        [$(($name, include_str!(concat!("../../../hw_models/", $folder, $name, ".toml"))),)*]
    };
}
const BUILTIN: [(&str, &str); 13] = models!(
    "": "ideal" "prime" "isaac" "reram" "pcm14" "ecram" "fefet" "sram" "neurram" "hermes" "mrr" "photonic_pcm" "mzi"
);

/// Devices that others have published, on the periphery of the ideal chip: not all of them learn by default, which is what they
/// are there to show.
const DEVICES: [(&str, &str); 19] = models!(
    "devices/": "ag_asi" "taox_tiox" "taox_hfox" "pcmo" "alox_hfo2" "gst_pcm" "epiram" "hzo_fefet" "neurosim_ideal"
    "aihwkit_reram_es" "aihwkit_reram_sb" "aihwkit_reram_array_om" "aihwkit_reram_array_hfo2" "aihwkit_capacitor"
    "aihwkit_ecram_li" "aihwkit_ecram_mo" "aihwkit_gokmen_vlasov" "aihwkit_idealized" "aihwkit_pcm"
);

/// A checked hardware model.
#[derive(Debug, Clone)]
pub struct Model {
    /// What it is called.
    pub name: String,
    /// One sentence.
    pub summary: String,
    /// Its text.
    pub text: String,
    /// The chip.
    pub hardware: Hardware,
    /// What its events, its parts and its idling cost.
    pub constants: Constants,
    /// Nanometres of the node that its numbers are of.
    pub node_nm: Option<f64>,
    /// Ways to use it: name and settings.
    pub modes: Vec<(String, Vec<String>)>,
    /// What is not simulated.
    pub not_simulated: Vec<(String, String)>,
}

/// Names of the built-in models.
#[must_use]
pub fn model_names() -> Vec<&'static str> {
    BUILTIN.iter().map(|(name, _)| *name).collect()
}

/// Names of published devices, each a model of its own.
#[must_use]
pub fn device_names() -> Vec<&'static str> {
    DEVICES.iter().map(|(name, _)| *name).collect()
}

/// Whether a name is one of this program's.
pub(super) fn is_builtin(name: &str) -> bool {
    BUILTIN.iter().chain(&DEVICES).any(|(builtin, _)| *builtin == name)
}

/// Models of published devices.
///
/// # Panics
/// When one of our own files is wrong: a test reads them all.
#[must_use]
pub fn builtin_devices() -> Vec<Model> {
    let load = |(name, _): &(&str, &str)| load_model(name).expect("built-in models are valid");
    DEVICES.iter().map(load).collect()
}

/// The built-in models.
///
/// # Panics
/// When one of our own files is wrong: a test reads them all.
#[must_use]
pub fn builtin_models() -> Vec<Model> {
    let load = |(name, _): &(&str, &str)| load_model(name).expect("built-in models are valid");
    BUILTIN.iter().map(load).collect()
}

/// Text of a model: a built-in name, or the path of a file.
pub(super) fn model_text(name: &str) -> Result<String, ConfigError> {
    if let Some((_, text)) = BUILTIN.iter().chain(&DEVICES).find(|(builtin, _)| *builtin == name) {
        return Ok((*text).to_owned());
    }
    let near = near::hint(name, model_names().into_iter().chain(device_names()));
    let (models, devices) = (model_names().join(", "), device_names().join(", "));
    let hint = format!("built-in models are {models}, devices {devices}{near}");
    #[expect(clippy::disallowed_methods, reason = "models live in files")]
    std::fs::read_to_string(name).map_err(|error| ConfigError::Unreadable {
        path: name.into(),
        error,
        hint,
    })
}

/// Reads a model file: every key known, every table with a source.
pub(super) fn model_file(name: &str, text: &str) -> Result<HardwareFile, ConfigError> {
    let file: HardwareFile = toml::from_str(text).map_err(|error| text_error(name, &error))?;
    let wrong = |key: &str, found: &str, allowed: &str| ConfigError::Value {
        key: key.into(),
        found: found.into(),
        allowed: allowed.into(),
    };
    if file.model.is_some() {
        let allowed = "a model stands for itself; remove the key";
        return Err(wrong("model", "names another model", allowed));
    }
    if file.name.is_none() {
        return Err(wrong("name", "is missing", "give the model a name"));
    }
    for (table, source, kind) in provenance(&file) {
        let key = format!("{table}.source");
        if source.is_none_or(|text| text.trim().is_empty()) {
            let allowed = "every table of a hardware model says where its numbers come from";
            return Err(wrong(&key, "is missing", allowed));
        }
        let key = format!("{table}.kind");
        match kind {
            Some("measured" | "fitted" | "assumed") => {}
            Some(other) => {
                let found = format!("is \"{other}\"");
                return Err(wrong(&key, &found, "it is measured, fitted or assumed"));
            }
            None => return Err(wrong(&key, "is missing", "it is measured, fitted or assumed")),
        }
    }
    Ok(file)
}

/// Checks the marks of tables that have one, whatever laid them over a model.
pub(super) fn check_marks(file: &HardwareFile, prefix: &str) -> Result<(), ConfigError> {
    for (table, _, kind) in provenance(file) {
        if let Some(other) = kind.filter(|mark| !["measured", "fitted", "assumed"].contains(mark)) {
            return Err(ConfigError::Value {
                key: format!("{prefix}{table}.kind"),
                found: format!("is \"{other}\""),
                allowed: "it says how far to trust the numbers: measured, fitted or assumed".into(),
            });
        }
    }
    Ok(())
}

/// `(table, source, kind)` of every table that is there.
fn provenance(file: &HardwareFile) -> Vec<(&'static str, Option<&str>, Option<&str>)> {
    let mut all = Vec::new();
    macro_rules! table {
        ($($name:ident)*) => {$(
            if let Some(table) = &file.$name {
                all.push((stringify!($name), table.source.as_deref(), table.kind.as_deref()));
            }
        )*};
    }
    table!(cell tile drive lut error write timing);
    macro_rules! device {
        ($($name:ident)*) => {$(
            if let Some(table) = file.device.as_ref().and_then(|device| device.$name.as_ref()) {
                let name = concat!("device.", stringify!($name));
                all.push((name, table.source.as_deref(), table.kind.as_deref()));
            }
        )*};
    }
    device!(response spread faults conductance wires read_noise programming drift endurance leakage);
    if let Some(super::file::AdcFile::Finite(table)) = &file.adc {
        all.push(("adc", table.source.as_deref(), table.kind.as_deref()));
    }
    all
}

/// The folder of a model's file.
pub(super) fn beside(name: &str) -> &std::path::Path {
    std::path::Path::new(name).parent().unwrap_or(std::path::Path::new(""))
}

/// Loads and checks a model by built-in name or path.
///
/// # Errors
/// When it cannot be read, has unknown keys, lacks a source or holds impossible numbers.
pub fn load_model(name: &str) -> Result<Model, ConfigError> {
    let text = model_text(name)?;
    let file = model_file(name, &text)?;
    let mut resolved = file.clone();
    if let Some(map) = resolved.device.as_mut().and_then(|of| of.faults.as_mut()?.map.as_mut()) {
        *map = beside(name).join(&*map).display().to_string();
    }
    let hardware = chip::resolve(&mut resolved, "")?;
    let constants = constants_of(&resolved, &hardware, "")?;
    Ok(Model {
        node_nm: file.node_nm,
        modes: file.modes.clone().unwrap_or_default().into_iter().collect(),
        name: file.name.clone().unwrap_or_default(),
        summary: file.summary.clone().unwrap_or_default(),
        hardware,
        constants,
        not_simulated: file.not_simulated.unwrap_or_default().into_iter().collect(),
        text,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_models_are_valid_and_named_like_their_files() {
        let models = builtin_models();
        assert!(models.iter().map(|model| model.name.as_str()).eq(model_names()));
        let devices = builtin_devices();
        assert!(devices.iter().map(|model| model.name.as_str()).eq(device_names()));
        assert!(devices.iter().all(|model| model.hardware.device.is_some()));
        for model in models.into_iter().chain(devices) {
            assert!(!model.summary.is_empty() && model.hardware.timing.is_some(), "{}", model.name);
            assert_eq!(model.constants.complaints(), [""; 0], "{}", model.name);
        }
    }

    #[test]
    fn a_table_without_a_source_is_refused() {
        let error = model_file("x.toml", "name = \"x\"\n[cell]\nlevel_bits = 4\n").unwrap_err();
        assert!(error.to_string().contains("`cell.source` is missing"), "{error}");
        let text = "name = \"x\"\n[cell]\nlevel_bits = 4\nsource = \"s\"\nkind = \"guess\"\n";
        let error = model_file("x.toml", text).unwrap_err().to_string();
        assert!(error.contains("`cell.kind` is \"guess\""), "{error}");
    }

    #[test]
    fn an_unknown_key_is_shown_with_a_caret_and_the_keys_there_are() {
        let error =
            model_file("x.toml", "name = \"x\"\n[adc]\nadc-bit = 8\n").unwrap_err().to_string();
        assert!(error.contains("unknown field `adc-bit`, expected one of `bits`"), "{error}");
        assert!(error.contains("line 3") && error.contains('^'), "{error}");
    }
}

use super::*;

fn constants(text: &str) -> Result<Constants, String> {
    let file: HardwareFile = toml::from_str(text).map_err(|e| e.to_string())?;
    let hardware = super::super::chip::resolve(&mut file.clone(), "").map_err(|e| e.to_string())?;
    constants_of(&file, &hardware, "").map_err(|e| e.to_string())
}

const SOURCE: &str = "source = \"s\", kind = \"measured\"";

#[test]
fn every_event_that_is_an_action_has_one_quantity() {
    for event in Event::ALL {
        let lines = QUANTITIES.iter().filter(|q| q.per == Per::of(event)).count();
        let outcome = matches!(event, Event::Requested | Event::Bounded | Event::PulsesEffective)
            || event.name().starts_with("saturated");
        assert_eq!(lines, usize::from(!outcome), "{event:?}");
    }
}

#[test]
fn the_unit_is_in_the_key() {
    for (key, joules) in [("hold_fj", 2e-15), ("hold_aj", 2e-18), ("hold_pj", 2e-12)] {
        let text = format!("energy.{key} = {{ low = 1, typical = 2, high = 3, {SOURCE} }}");
        let found = constants(&text).unwrap();
        let value = found.of(Event::Holds).unwrap().value[1];
        assert!((value / joules - 1.0).abs() < 1e-12, "{key}: {value}");
    }
}

#[test]
fn what_is_incomplete_or_in_the_wrong_order_is_refused() {
    for (number, wanted) in [
        (format!("low = 1, typical = 2, {SOURCE}"), "`energy.hold_fj.high` is missing"),
        (format!("low = 2, typical = 1, high = 3, {SOURCE}"), "low <= typical <= high"),
        (format!("low = 1, typical = 3, high = 2, {SOURCE}"), "low <= typical <= high"),
        (format!("low = -1, typical = 3, high = 4, {SOURCE}"), "0 <= low"),
        ("low = 1, typical = 2, high = 3, kind = \"measured\"".into(), "`energy.hold_fj.source`"),
        (
            "low = 1, typical = 2, high = 3, source = \" \", kind = \"measured\"".into(),
            "says where it comes from",
        ),
        (
            "low = 1, typical = 2, high = 3, source = \"s\", kind = \"true\"".into(),
            "measured, fitted or assumed",
        ),
        (format!("low = 1, typical = 2, high = 3, sigma = 1, {SOURCE}"), "unknown field `sigma`"),
    ] {
        let error = constants(&format!("energy.hold_fj = {{ {number} }}")).unwrap_err();
        assert!(error.contains(wanted), "{number}: {error}");
    }
    let twice = format!(
        "energy.hold_fj = {{ low = 1, typical = 2, high = 3, {SOURCE} }}\n\
         energy.hold_pj = {{ low = 1, typical = 2, high = 3, {SOURCE} }}"
    );
    assert!(constants(&twice).unwrap_err().contains("given once"));
}

#[test]
fn an_unknown_key_or_unit_shows_its_line_and_what_there_is() {
    for key in ["hold_kg", "holding_fj", "hold", "laser_mw"] {
        let error = constants(&format!("[energy]\n{key} = {{ low = 1 }}")).unwrap_err();
        assert!(error.contains(&format!("unknown field `{key}`")), "{error}");
        assert!(error.contains("line 2") && error.contains("`hold`"), "{error}");
    }
}

/// MNSIM's table of converters gives the 8-bit DAC 0.4992 W where 0.4992 mW is meant.
#[test]
fn a_public_table_with_a_missing_milli_is_caught() {
    for (picojoules, caught) in [(0.4992, false), (499.2, true)] {
        let text = format!(
            "energy.dac_slice_pj = {{ low = {picojoules}, typical = {picojoules}, high = {picojoules}, {SOURCE} }}"
        );
        let complaints = constants(&text).unwrap().complaints();
        assert_eq!(!complaints.is_empty(), caught, "{complaints:?}");
    }
}

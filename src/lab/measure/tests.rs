use proptest::prelude::*;

use super::*;
use crate::num::tables::Response;

/// Reads of a cell without noise that goes up and down twice, by its steps.
fn reads(steps: impl Fn(f64) -> [f64; 2], pulses: u32) -> String {
    let (mut text, mut x) = ("pulse,polarity,g\n0,,0\n".to_owned(), 0.0f64);
    for round in 0..4 {
        for pulse in 1..=pulses {
            let [up, down] = steps(x);
            x = (if round % 2 == 0 { x + up } else { x - down }).clamp(0.0, 1.0);
            let way = if round % 2 == 0 { "up" } else { "down" };
            text += &format!("{pulse},{way},{x:.12}\n");
        }
    }
    text
}

fn measured(text: &str) -> MeasuredDevice {
    MeasuredDevice::new("x.csv", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_kind_with_fewest_numbers_is_proposed() {
    let soft = measured(&reads(|x| [0.04 * (1.0 - x), 0.03 * x], 300));
    assert_eq!(soft.best().response.name(), "soft_bounds", "{:?}", soft.kinds);
    let line = measured(&reads(|x| [0.02 + 0.01 * x, 0.025 - 0.005 * x], 80));
    assert_eq!(line.best().response.name(), "linear", "{:?}", line.kinds);
    // a hump is no kind but a table
    let hump = |x: f64| 0.01 + 0.03 * (1.0 - (2.0 * x - 1.0) * (2.0 * x - 1.0));
    let hump = measured(&reads(|x| [hump(x), hump(x)], 80));
    assert_eq!(hump.best().response.name(), "table", "{:?}", hump.kinds);
    for one in [soft, line, hump] {
        assert_eq!(one.device.noise, PulseNoise::Off);
        assert!(one.best().curve_rms < 0.01, "{}", one.best().curve_rms);
        assert!(
            one.device.check().is_ok() && one.said.last().unwrap().contains("how cells differ")
        );
    }
}

#[test]
fn too_little_and_the_wrong_way_are_refused() {
    let error = |text: &str| MeasuredDevice::new("x", text.as_bytes()).unwrap_err().to_string();
    let up: String = (0..20).map(|i| format!("{i},up,{i}\n")).collect();
    let all = error(&format!("pulse,polarity,g\n{up}"));
    assert!(all.contains("19 pulses up and 0 down"), "{all}");
    let text = reads(|x| [0.05 * (1.0 - x), 0.05 * x], 60);
    let turned = text.replace("up", "x").replace("down", "up").replace('x', "down");
    assert!(error(&turned).contains("the other way"), "{}", error(&turned));
    // two states: every pulse ends at an end
    let text = reads(|_| [1.0, 1.0], 10);
    assert!(error(&text).contains("0 pulses up and 0 down that move"), "{}", error(&text));
}

#[test]
fn a_file_says_where_every_number_is_from() {
    let one = measured(&reads(|x| [0.04 * (1.0 - x), 0.03 * x], 300));
    let text = one.hardware_toml("mine");
    for wanted in ["x.csv (blake3 ", "600 pulses up and 600 down of one device", "[not_simulated]"]
    {
        assert!(text.contains(wanted), "{wanted} in {text}");
    }
    let Response::SoftBounds(soft) = &one.best().response else { panic!("{:?}", one.best()) };
    assert!(text.contains(&format!("up = [{}]\ndown = [{}]\n", soft.up, soft.down)));
    assert_eq!(one.levels(), (8, [0, 255]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whatever is measured, it is refused or becomes a device that a chip can have, in a file that is read.
    #[test]
    fn any_reads_are_a_device_or_an_error(
        reads in prop::collection::vec((0u8..3, 0u32..4, any::<bool>(), -1i32..9), 0..300),
        columns in 0u8..8,
    ) {
        let [with_device, with_pulse, with_way] = [0, 1, 2].map(|bit| columns >> bit & 1 == 1);
        let line = |parts: [(bool, String); 4]| {
            let kept = parts.into_iter().filter(|(kept, _)| *kept).map(|(_, part)| part);
            kept.collect::<Vec<_>>().join(",") + "\n"
        };
        let all = |device: String, pulse: String, way: String, g: String| {
            line([(with_device, device), (with_pulse, pulse), (with_way, way), (true, g)])
        };
        let mut text = all("device".into(), "pulse".into(), "polarity".into(), "g".into());
        let (mut pulses, mut g) = (0, 0);
        for (device, more, up, step) in reads {
            pulses = if more == 0 { 0 } else { pulses + more };
            g = (if up { g + step } else { g - step }).clamp(0, 40);
            let way = if up { "up" } else { "down" };
            text += &all(device.to_string(), pulses.to_string(), way.into(), g.to_string());
        }
        if let Ok(found) = MeasuredDevice::new("any.csv", text.as_bytes()) {
            prop_assert_eq!(found.device.check(), Ok(()));
            let text = found.hardware_toml("any");
            prop_assert!(toml::from_str::<toml::Table>(&text).is_ok(), "{}", text);
            prop_assert!(found.best().curve_rms.is_finite());
        }
    }
}

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

//! `hw peak --modes`: every way to use a chip that its model lists, at every width of its converters that is asked for.

use serde_json::json;

use super::super::{Done, say, usage};
use super::{PeakArgs, changed};
use crate::lab::config::load_model;
use crate::lab::price::{Convention, peak};

/// Widths of a converter: `10`, or `3..10`.
pub(super) fn widths(text: &str) -> Result<Vec<i64>, String> {
    let number = |text: &str| {
        let number = text.trim().parse::<i64>().ok().filter(|bits| (2..=16).contains(bits));
        number.ok_or_else(|| {
            format!("{text} is no width of a converter: give 2 to 16, or a range such as 3..10")
        })
    };
    let (from, to) = text.split_once("..").unwrap_or((text, text));
    let (from, to) = (number(from)?, number(to.trim_start_matches('='))?);
    if from > to {
        return Err(format!("{from}..{to} is empty: begin with the least"));
    }
    Ok((from..=to).collect())
}

/// One row a mode, one column a width: operations a second of reads that follow one another.
pub(super) fn show(args: &PeakArgs) -> Done {
    let model = load_model(&args.model).map_err(|e| usage(&e.to_string()))?;
    if model.modes.is_empty() {
        let message = format!("{} lists no [modes]: name settings there, or use --set", model.name);
        return Err(usage(&message));
    }
    let widths = args.adc_bits.as_ref();
    let columns: Vec<Option<i64>> =
        widths.map_or_else(|| vec![None], |widths| widths.iter().copied().map(Some).collect());
    let convention = Convention::with_cells(args.cells);
    let mut lines = Vec::new();
    for (name, keys) in &model.modes {
        let mut line = format!("  {name:24}");
        for bits in &columns {
            let mut settings: Vec<String> = keys.iter().map(|key| format!("hw.{key}")).collect();
            settings.extend(bits.map(|bits| format!("hw.adc.bits={bits}")));
            settings.extend(args.settings.iter().cloned());
            let config = changed(&args.model, &settings)?;
            let hardware = &config.hardware;
            let tiles = args.tiles.or(hardware.tile.count_max.map(|n| n as u64)).unwrap_or(1);
            let Some(peak) = peak(hardware, tiles, hardware.slices().into(), convention) else {
                return Err(usage(
                    "the model has no [timing]: give it at least hw.timing.clock_mhz",
                ));
            };
            let (figure, rate) = &peak.alone;
            if args.json {
                let object = json!({"event": "mode", "model": model.name, "mode": name, "adc_bits": bits,
                    "tiles": tiles, "convention": convention.to_json(), "cycles": figure.cycles,
                    "seconds": figure.seconds, "operations_per_second": rate});
                say(&object.to_string());
            }
            line += &format!(" {:>8.4}", rate / 1e12);
        }
        lines.push(line);
    }
    if args.json {
        return Ok(());
    }
    say(&format!("{}: TOPS, one read after the other ({})", model.name, convention.words()));
    if widths.is_some() {
        let heads = columns.iter().flatten().map(|bits| format!(" {bits:>8}"));
        say(&format!("  {:24}{}", "converter bits", heads.collect::<String>()));
    }
    lines.iter().for_each(|line| say(line));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_one_or_a_range() {
        assert_eq!(widths("10"), Ok(vec![10]));
        assert_eq!(widths("3..6"), Ok(vec![3, 4, 5, 6]));
        assert_eq!(widths("3..=4"), Ok(vec![3, 4]));
        for wrong in ["", "1", "17", "6..3", "3..x", "3-6"] {
            assert!(widths(wrong).is_err(), "{wrong}");
        }
    }
}

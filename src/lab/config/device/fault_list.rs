//! Lists of stuck cells: `layer,pathway,row,column,state`, a cell a line; of a CSV file or of the configuration itself.
//!
//! A list is read where it is named and kept in the resolved configuration, so a run holds it wherever its folder goes.

use crate::chip::device::{FaultMap, ListedCell, StuckAt};
use crate::chip::population::Pathway;
use crate::lab::config::ConfigError;
use crate::lab::config::check::wrong;

/// Greatest size of a file: some ten million cells.
const BYTES_MAX: u64 = 256 << 20;
/// What a line says, as a head line may repeat it.
const COLUMNS: [&str; 5] = ["layer", "pathway", "row", "column", "state"];

/// The lines of a file that list a cell, each with its number, spaces taken out.
fn lines(text: &str) -> impl Iterator<Item = (usize, String)> {
    let tight = |line: &str| line.chars().filter(|c| !c.is_whitespace()).collect::<String>();
    let lines = text.lines().enumerate().map(move |(at, line)| (at + 1, tight(line)));
    let said = |(_, line): &(usize, String)| !line.is_empty() && !line.starts_with('#');
    let mut first = true;
    lines.filter(said).filter(move |(_, line)| {
        let head = std::mem::replace(&mut first, false) && *line == COLUMNS.join(",");
        !head
    })
}

/// One cell, or what is wrong with its line.
fn cell(line: &str) -> Result<ListedCell, (String, String)> {
    let parts: Vec<&str> = line.split(',').collect();
    let [layer, pathway, row, column, state] = parts[..] else {
        let found = format!("has {} columns", parts.len());
        return Err((found, format!("a line is {}", COLUMNS.join(","))));
    };
    let number = |name: &str, text: &str, most: u32| -> Result<u32, (String, String)> {
        let number = text.parse().ok().filter(|number| *number <= most);
        number.ok_or_else(|| {
            (format!("has {name} \"{text}\""), format!("it is a whole number in 0..={most}"))
        })
    };
    let code = Pathway::named(pathway).ok_or_else(|| {
        let allowed = format!("it is one of {}", Pathway::names().join(", "));
        (format!("has pathway \"{pathway}\""), allowed)
    })?;
    let at = match state {
        "floor" => StuckAt::Floor,
        "ceiling" => StuckAt::Ceiling,
        level if level.starts_with(|c: char| c.is_ascii_digit()) => {
            let level = number("state", level, 4095)?;
            StuckAt::Level(u16::try_from(level).expect("12 bits"))
        }
        _ => {
            let allowed = "it is a level, floor or ceiling".to_owned();
            return Err((format!("has state \"{state}\""), allowed));
        }
    };
    Ok(ListedCell {
        layer: u16::try_from(number("layer", layer, 63)?).expect("6 bits"),
        pathway: code,
        row: number("row", row, 65_534)?,
        column: number("column", column, 65_534)?,
        at,
    })
}

/// A list. `place` says where line number `line` stands.
fn list<'a>(
    key: &str,
    lines: impl Iterator<Item = (usize, &'a str)> + Clone,
    place: &dyn Fn(usize) -> String,
) -> Result<FaultMap, ConfigError> {
    let at = |line: usize, (found, allowed): (String, String)| {
        wrong(key, format!("{} {found}", place(line)), allowed)
    };
    let cells = lines.clone().map(|(line, text)| cell(text).map_err(|error| at(line, error)));
    let map = FaultMap::new(cells.collect::<Result<_, _>>()?).map_err(|twice| {
        let same =
            |text: &str| cell(text).is_ok_and(|of| ListedCell { at: twice.at, ..of } == twice);
        let line = lines.filter(|(_, text)| same(text)).nth(1).map_or(0, |(line, _)| line);
        at(line, ("lists a cell again".into(), "a cell is listed once".into()))
    })?;
    if map.is_empty() {
        return Err(wrong(key, "lists no cell", "give a line a stuck cell, or take the key out"));
    }
    Ok(map)
}

/// A word for a list: a hash of what it says, whatever file it comes from and however that is written.
pub(in crate::lab::config) fn listed(map: &FaultMap) -> String {
    if map.is_empty() {
        return "none".into();
    }
    let mut hasher = blake3::Hasher::new();
    for &ListedCell { layer, pathway, row, column, at } in map.cells() {
        let state = match at {
            StuckAt::Floor => "floor".into(),
            StuckAt::Ceiling => "ceiling".into(),
            StuckAt::Level(level) => level.to_string(),
        };
        hasher.update(format!("{layer},{pathway},{row},{column},{state}\n").as_bytes());
    }
    format!("{} cells {}", map.cells().len(), hasher.finalize())
}

/// The cells of a configuration.
pub(super) fn of_cells(key: &str, cells: &[String]) -> Result<FaultMap, ConfigError> {
    let lines = cells.iter().enumerate().map(|(at, line)| (at + 1, line.as_str()));
    list(key, lines, &|line| format!("number {line}"))
}

/// The cells of a file, as they are kept in a configuration.
pub(super) fn read(key: &str, path: &str) -> Result<Vec<String>, ConfigError> {
    let unreadable = |error| {
        let hint = format!("`{key}` names a CSV file; in a file, relative to that file");
        ConfigError::Unreadable { path: path.into(), error, hint }
    };
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > BYTES_MAX {
        return Err(wrong(key, format!("names {path}, of {size} bytes"), "at most 256 MiB"));
    }
    #[expect(clippy::disallowed_methods, reason = "lists of cells live in files")]
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    let lines: Vec<_> = lines(&text).collect();
    let said = lines.iter().map(|(line, text)| (*line, text.as_str()));
    list(key, said, &|line| format!("{path}, line {line}"))?;
    Ok(lines.into_iter().map(|(_, line)| line).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_cell_and_comments_are_none() {
        let text =
            "layer, pathway, row, column, state\n# a chip\n0, pp, 3, 5, floor\n\n 1,np,0,7, 12\n";
        let found: Vec<_> = lines(text).collect();
        assert_eq!(found, [(3, "0,pp,3,5,floor".into()), (5, "1,np,0,7,12".into())]);
        let cells: Vec<String> = found.into_iter().map(|(_, line)| line).collect();
        let map = of_cells("key", &cells).unwrap();
        let wanted = [
            ListedCell { layer: 0, pathway: 0, row: 3, column: 5, at: StuckAt::Floor },
            ListedCell { layer: 1, pathway: 1, row: 0, column: 7, at: StuckAt::Level(12) },
        ];
        assert_eq!(map.cells(), wanted);
    }

    #[test]
    fn mistakes_name_the_line_and_what_is_allowed() {
        for (line, wanted) in [
            ("0,pp,3,5", "number 2 has 4 columns"),
            ("x,pp,3,5,floor", "number 2 has layer \"x\"; it is a whole number in 0..=63"),
            ("0,qq,3,5,floor", "has pathway \"qq\"; it is one of pp, np, nn, pn, e, i, pp_i"),
            ("0,pp,-1,5,floor", "has row \"-1\""),
            ("0,pp,3,65535,floor", "has column \"65535\""),
            ("0,pp,3,5,high", "has state \"high\"; it is a level, floor or ceiling"),
            ("0,pp,3,5,5000", "has state \"5000\""),
            ("0,pp,0,0,7", "number 2 lists a cell again"),
        ] {
            let cells = ["0,pp,0,0,floor", line].map(str::to_owned);
            let error = of_cells("hw.device.faults.cells", &cells).unwrap_err().to_string();
            assert!(error.contains(wanted), "{line}: {error}");
        }
        assert!(of_cells("key", &[]).unwrap_err().to_string().contains("lists no cell"));
    }
}

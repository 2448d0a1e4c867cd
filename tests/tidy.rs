//! The map is part of the code: what may lean on what, what the core must not touch, and that documents name things
//! that exist.
//!
//! The table [`HOUSE`] is the house of docs/ARCHITECTURE.md. A wing may use the wings before it, a room the rooms
//! before it in its own wing, never the other way round. [`source`] reads Rust as
//! tokens, without comments and strings.
#![expect(clippy::disallowed_methods, reason = "this test reads the files of the project")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "tidy/api.rs"]
mod api;
#[path = "tidy/items.rs"]
mod items;
#[path = "tidy/source.rs"]
mod source;

use source::{is_word, module_of, reaches, tokens};

/// Wings in order, each with its rooms in order.
const HOUSE: [(&str, &[&str]); 6] = [
    ("num", &["fixed", "draw", "tables"]),
    (
        "chip",
        &[
            "state",
            "device",
            "hardware",
            "ledger",
            "periphery",
            "crossbar",
            "population",
            "layer",
            "engine",
        ],
    ),
    ("learn", &["error", "route", "statistics", "rule", "driver", "network", "outside"]),
    ("task", &["classify", "environment", "policy"]),
    (
        "lab",
        &[
            "near", "analysis", "data", "config", "measure", "store", "price", "table", "report",
            "run", "wave", "sweep", "runs",
        ],
    ),
    (
        "cli",
        &[
            "out", "known", "progress", "table", "data", "hw", "keys", "deploy", "run", "report",
            "sweep", "export", "store", "price", "runs", "trace", "watch", "analyse", "bench",
        ],
    ),
];

/// Wings that know no floats, clocks, hash maps, environment or files.
const CORE: [&str; 4] = ["num", "chip", "learn", "task"];
/// The one room of the core where floats become integers: its front door and its folder.
const FLOAT_ROOM: [&str; 2] = ["src/num/tables.rs", "src/num/tables/"];
/// Where the loops over cells live: the only home of `unsafe` in the program.
const KERNELS: &str = "src/chip/crossbar/kernel";
/// The test that calls the verilated tile: the only home of `unsafe` in the tests.
const FOREIGN: &str = "tests/rtl";
/// Most lines of a source file.
const LINES_MAX: usize = 600;

// --- files ---

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Files below `folder` with the extension `.rs`, as paths from the root with `/`, sorted.
fn sources(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    walk(&root().join(folder), &mut found);
    found.retain(|path| path.ends_with(".rs"));
    assert!(!found.is_empty(), "{folder} holds source");
    found
}

fn walk(folder: &Path, found: &mut Vec<String>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> =
        entries.map(|entry| entry.expect("a folder can be listed").path()).collect();
    paths.sort();
    for path in paths {
        // what .gitignore names
        let ignored = [".git", "target", "runs", "data"].map(|name| root().join(name));
        if path.is_symlink() || ignored.contains(&path) {
            continue;
        }
        if path.is_dir() {
            walk(&path, found);
        } else {
            let below = path.strip_prefix(root()).expect("found below the root");
            let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
            found.push(parts.join("/"));
        }
    }
}

/// Files that version control keeps; where there is none, every file.
fn tracked() -> Vec<String> {
    let listing = Command::new("git").arg("ls-files").arg("-z").current_dir(root()).output();
    if let Ok(listing) = listing
        && listing.status.success()
        && !listing.stdout.is_empty()
    {
        let text = String::from_utf8(listing.stdout).expect("names of files are text");
        return text.split_terminator('\0').map(str::to_owned).collect();
    }
    let mut found = Vec::new();
    walk(&root(), &mut found);
    found
}

fn assert_none(problems: &[String], rule: &str) {
    assert!(problems.is_empty(), "{rule}:\n  {}", problems.join("\n  "));
}

fn wing_number(name: &str) -> Option<usize> {
    HOUSE.iter().position(|(wing, _)| *wing == name)
}

/// Why a file may not use a path; `None` when it may.
fn violation(from: &[String], to: &[String]) -> Option<String> {
    let [wing, ..] = from else { return None }; // lib.rs and main.rs see everything
    let own = wing_number(wing).unwrap_or_else(|| panic!("wing `{wing}` is in the table"));
    let target = to.first()?;
    let Some(other) = wing_number(target) else {
        return Some(format!("`{target}` is no wing"));
    };
    if other != own {
        return (other > own)
            .then(|| format!("wing `{wing}` may not use the later wing `{target}`"));
    }
    let room = from.get(1)?; // a front door lists its rooms
    let rooms = HOUSE[own].1;
    let number = |name: &String| rooms.iter().position(|room| room == name);
    let mine = number(room).unwrap_or_else(|| panic!("room `{wing}::{room}` is in the table"));
    match to.get(1).map(|name| (name, number(name))) {
        Some((name, Some(theirs))) => {
            (theirs > mine).then(|| format!("room `{wing}::{room}` may not use the later `{name}`"))
        }
        // the command line keeps what its commands share in its front door
        _ => (wing != "cli").then(|| format!("room `{wing}::{room}` uses its own front door")),
    }
}

// --- the house ---

#[test]
fn the_table_lists_every_room_and_no_other() {
    let wanted: BTreeSet<String> = HOUSE
        .iter()
        .flat_map(|(wing, rooms)| rooms.iter().map(move |room| format!("src/{wing}/{room}.rs")))
        .collect();
    let found = sources("src").into_iter().filter(|path| path.split('/').count() == 3);
    assert_eq!(found.collect::<BTreeSet<_>>(), wanted);
}

#[test]
fn nothing_leans_on_what_comes_later() {
    let mut problems = Vec::new();
    let mut seen = 0;
    for path in sources("src") {
        let from = module_of(&path);
        for (to, line) in reaches(&path, &read(&path)) {
            seen += 1;
            if let Some(why) = violation(&from, &to) {
                problems.push(format!("{path}:{line}: {} ({why})", to.join("::")));
            }
        }
    }
    assert!(seen > 200, "paths were found ({seen})");
    assert_none(&problems, "a wing may use earlier wings, a room earlier rooms of its wing");
}

#[test]
fn the_core_knows_no_floats() {
    let mut problems = Vec::new();
    for path in CORE.iter().flat_map(|wing| sources(&format!("src/{wing}"))) {
        for (word, line) in tokens(&read(&path)) {
            let float = word.ends_with("f32") || word.ends_with("f64");
            let literal = word.starts_with(|c: char| c.is_ascii_digit()) && !word.starts_with("0x");
            if !FLOAT_ROOM.iter().any(|room| path.starts_with(room))
                && float
                && (literal || word.len() == 3)
            {
                problems.push(format!("{path}:{line}: {word}"));
            }
        }
    }
    assert_none(
        &problems,
        "floats become integers in the room num::tables and nowhere else in the core",
    );
}

#[test]
fn the_core_knows_no_clock_order_environment_or_file() {
    let words = ["HashMap", "HashSet", "Instant", "SystemTime", "RandomState"];
    let modules = ["fs", "env", "net", "time", "process"];
    let mut problems = Vec::new();
    for path in CORE.iter().flat_map(|wing| sources(&format!("src/{wing}"))) {
        let tokens = tokens(&read(&path));
        for (i, (word, line)) in tokens.iter().enumerate() {
            let of_std = i >= 2 && tokens[i - 1].0 == "::" && tokens[i - 2].0 == "std";
            if words.contains(&&**word) || of_std && modules.contains(&&**word) {
                problems.push(format!("{path}:{line}: {word}"));
            }
        }
    }
    assert_none(&problems, "a result depends on nothing but configuration, data and seed");
}

#[test]
fn unsafe_stays_in_the_kernels() {
    let mut problems = Vec::new();
    for path in ["src", "tests", "hw_models"].iter().flat_map(|folder| sources(folder)) {
        let at_home = path.starts_with(&format!("{KERNELS}/"))
            || path == format!("{KERNELS}.rs")
            || path.starts_with(&format!("{FOREIGN}/"));
        let tokens = tokens(&read(&path));
        let found = tokens.iter().filter(|(word, _)| word == "unsafe");
        if !at_home {
            problems.extend(found.map(|(_, line)| format!("{path}:{line}")));
        }
    }
    assert_none(&problems, "`unsafe` lives under src/chip/crossbar/kernel and tests/rtl");
}

#[test]
fn files_stay_short() {
    let mut problems = Vec::new();
    let models = ["ed_tile.sv", "ed_bank.sv"].map(|file| format!("hw_models/rtl/{file}"));
    let code = ["src", "tests", "hw_models"].iter().flat_map(|folder| sources(folder));
    for path in code.chain(models) {
        let lines = read(&path).lines().count();
        if lines > LINES_MAX {
            problems.push(format!("{path}: {lines} lines"));
        }
    }
    assert_none(&problems, "a source file has at most 600 lines");
}

#[test]
fn lints_are_expected_not_allowed() {
    let mut problems = Vec::new();
    for path in ["src", "tests", "hw_models"].iter().flat_map(|folder| sources(folder)) {
        let tokens = tokens(&read(&path));
        for three in tokens.windows(3) {
            if three[0].0 == "[" && three[1].0 == "allow" && three[2].0 == "(" {
                problems.push(format!("{path}:{}", three[1].1));
            }
        }
    }
    assert_none(&problems, "use #[expect(lint, reason = \"...\")]");
}

/// Where a list of tokens occurs in the program.
fn places(wanted: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for path in sources("src") {
        let tokens = tokens(&read(&path));
        let hits = tokens.windows(wanted.len()).filter(|window| {
            window.iter().zip(wanted).all(|((token, _), wanted)| token == wanted || *wanted == "*")
        });
        found.extend(hits.map(|window| format!("{path}:{}", window[0].1)));
    }
    found
}

#[test]
fn no_layer_is_special() {
    let mut problems = places(&["is_state"]);
    for name in ["layer", "index", "l"] {
        for zero in [["0", "=", "=", name], [name, "=", "=", "0"]] {
            problems.extend(places(&zero));
        }
    }
    assert_none(&problems, "what the first layer does otherwise is said by its specification");
    assert!(!places(&["layer", "=", "=", "*"]).is_empty(), "comparisons are found");
}

#[test]
fn what_files_and_hashes_hold_is_listed_once() {
    let mut problems = places(&["ALL", ":", "[", "Self", ";"]);
    problems.retain(|place| !place.starts_with("src/chip/ledger.rs:"));
    assert_none(
        &problems,
        "enums that files and hashes use are made by `coded!` (src/chip/ledger.rs)",
    );
}

#[test]
fn a_public_type_has_a_name_of_its_own() {
    let mut names: Vec<(String, String)> = Vec::new();
    for path in sources("src") {
        for three in tokens(&read(&path)).windows(3) {
            let kind = ["struct", "enum", "trait", "union"].contains(&three[1].0.as_str());
            if three[0].0 == "pub" && kind && three[2].0 != "$" {
                names.push((three[2].0.clone(), format!("{path}:{}", three[2].1)));
            }
        }
    }
    names.sort();
    let twice = names.windows(2).filter(|two| two[0].0 == two[1].0);
    let twice: Vec<_> =
        twice.map(|two| format!("{}: {} and {}", two[0].0, two[0].1, two[1].1)).collect();
    assert!(names.len() > 100, "types are found");
    assert_none(&twice, "a public type has a name that no other has");
}

// --- documents ---

/// Paths a document names: in backquotes below a folder of ours, and targets of links, from the root.
fn named_paths(document: &str) -> Vec<String> {
    let folders = ["src/", "tests/", "docs/", "examples/", "hw_models/", ".ci/"];
    let text = read(document);
    let fences: Vec<&str> = text.split("```").step_by(2).collect();
    let prose = fences.concat();
    let spans = prose.split('`').skip(1).step_by(2);
    let is_path = |s: &&str| {
        folders.iter().any(|folder| s.starts_with(folder))
            && s.chars().all(|c| is_word(c) || "./-".contains(c))
    };
    let mut found: Vec<String> = spans.filter(is_path).map(str::to_owned).collect();
    let folder = Path::new(document).parent().expect("a document lies in a folder").to_owned();
    for target in prose.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        let target = target.split('#').next().unwrap_or_default();
        if !target.is_empty() && !target.contains("://") {
            found.push(folder.join(target).to_string_lossy().into_owned());
        }
    }
    found
}

#[test]
fn documents_name_files_that_exist() {
    let mut problems = Vec::new();
    for (document, least) in [
        ("docs/ARCHITECTURE.md", 30),
        ("docs/MODEL.md", 15),
        ("docs/GLOSSARY.md", 1),
        ("docs/DECISIONS.md", 1),
    ] {
        let paths = named_paths(document);
        assert!(paths.len() >= least, "{document} names files ({})", paths.len());
        let missing = paths.iter().filter(|path| !root().join(path).exists());
        problems.extend(missing.map(|path| format!("{document}: {path}")));
    }
    assert_none(&problems, "every path a document names exists");
}

/// Numbers at the head of the headings of the model document.
fn sections() -> BTreeSet<String> {
    let text = read("docs/MODEL.md");
    let headings = text.lines().filter_map(|line| line.strip_prefix('#'));
    headings
        .filter_map(|line| line.trim_start_matches('#').split_whitespace().next())
        .map(|number| number.trim_end_matches('.').to_owned())
        .filter(|number| number.starts_with(|c: char| c.is_ascii_digit()))
        .collect()
}

#[test]
fn references_to_the_model_name_its_sections() {
    let sections = sections();
    let mut problems = Vec::new();
    let mut seen = 0;
    for path in sources("src") {
        // comments may break a line between the document and the number
        let lines = read(&path);
        let lines =
            lines.lines().map(|line| line.trim_start().trim_start_matches(['/', '!']).trim());
        let text = lines.collect::<Vec<_>>().join(" ");
        for rest in text.split("docs/MODEL.md").skip(1) {
            let Some(rest) = rest.strip_prefix(", ") else { continue };
            let list = rest.split(|c: char| !(c.is_ascii_digit() || ". and,".contains(c))).next();
            let numbers =
                list.unwrap_or_default().split([' ', ',']).map(|n| n.trim_end_matches('.'));
            let numbers = numbers.filter(|n| n.starts_with(|c: char| c.is_ascii_digit()));
            for number in numbers {
                seen += 1;
                if !sections.contains(number) {
                    problems.push(format!("{path}: section {number}"));
                }
            }
        }
    }
    assert!(seen >= 15, "references were found ({seen})");
    assert_none(&problems, "a reference to docs/MODEL.md names one of its sections");
}

#[test]
fn every_dependency_has_a_line_of_reason() {
    let decisions = read("docs/DECISIONS.md");
    let mut problems = Vec::new();
    for manifest in ["Cargo.toml", "python/Cargo.toml", "tests/fuzz/Cargo.toml"] {
        let mut inside = false;
        for line in read(manifest).lines() {
            if line.starts_with('[') {
                inside = line.trim_matches(['[', ']']).ends_with("dependencies");
            } else if let (true, Some((name, _))) = (inside, line.split_once('=')) {
                let name = name.trim();
                let told = |line: &str| line.contains(&format!("`{name}`"));
                if name != "dalean" && !decisions.lines().any(told) {
                    problems.push(format!("{manifest}: {name}"));
                }
            }
        }
    }
    assert_none(&problems, "a dependency has a line in docs/DECISIONS.md");
}

#[test]
fn no_file_knows_the_machine_it_was_written_on() {
    // put together here, so that this file does not contain them
    let folders = ["work", "root", "home", "Users"].map(|name| format!("/{name}/"));
    let hosts =
        ["registry.npmjs", "pypi", "crates-io", "static.crates", "index.crates", "deb.debian"];
    let hosts = hosts.map(|host| format!("://{host}."));
    let index = format!("source = \"registry+https://github.com/rust-lang/crates.{}-index\"", "io");
    let mut problems = Vec::new();
    for path in tracked() {
        let Ok(bytes) = fs::read(root().join(&path)) else { continue };
        let text = String::from_utf8_lossy(&bytes);
        for (number, line) in text.lines().enumerate() {
            let marked = folders.iter().chain(&hosts).any(|mark| line.contains(mark));
            let strange =
                path.ends_with("Cargo.lock") && line.starts_with("source") && line != index;
            if marked || strange {
                problems.push(format!("{path}:{}: {}", number + 1, line.trim()));
            }
        }
    }
    assert_none(&problems, "files name no folder of one machine and no registry host");
}

#[test]
fn the_table_is_enforced_in_both_directions() {
    let path = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
    let allowed = |from, to| violation(&path(from), &path(to)).is_none();
    assert!(
        allowed("learn::route", "chip::layer::Taps") && !allowed("chip::layer", "learn::route")
    );
    assert!(
        allowed("chip::engine::forward", "chip::layer") && !allowed("chip::layer", "chip::engine")
    );
    assert!(allowed("chip::engine::forward", "chip::engine::Engine"));
    assert!(!allowed("chip::layer", "chip::Layer") && allowed("cli::run", "cli::say"));
    assert!(!allowed("num::fixed", "lab") && !allowed("num::fixed", "nowhere::at_all"));
}

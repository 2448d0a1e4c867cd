//! The public face as text: every name of src/lib.rs with what can be seen of it. A name, method, field or variant that
//! comes, goes or changes shows in tests/golden/api.txt; `UPDATE_EXPECT=1` renews it.
//!
//! A name is followed through `use` to the file that defines it; its inherent methods are looked for in every file from
//! where that definition is meant.

use std::collections::BTreeMap;
use std::fmt::Write;

use expect_test::expect_file;

use super::items::{items, open_item, said, without_attributes, without_tests};
use super::source::{is_word, module_of, tokens};
use super::{read, sources};

/// The macro that writes types by the list; `$name` stands for each.
const MACRO: &str = "bounded";

/// One file below src, as words.
struct File {
    module: Vec<String>,
    words: Vec<String>,
}

/// A name that a file brings in: where it is from, and what it is called there.
type Brought = (Vec<String>, String);

struct Crate(BTreeMap<String, File>);

impl Crate {
    fn read() -> Self {
        let library = sources("src").into_iter().filter(|path| path != "src/main.rs");
        let files = library.map(|path| {
            let words = tokens(&read(&path)).into_iter().map(|(word, _)| word);
            let words = without_tests(words.filter(|word| word != "$").collect());
            let module = module_of(&path);
            (module.join("::"), File { module, words })
        });
        Self(files.collect())
    }

    /// The file that defines a name of a module, and the place of the definition's first word.
    fn definition(&self, module: &[String], name: &str) -> Option<(&File, usize)> {
        let file = self.0.get(&module.join("::"))?;
        let kinds = ["struct", "enum", "fn", "const", "trait", "type"];
        let words = &file.words;
        let here = top(words).find(|&at| {
            kinds.contains(&&*words[at]) && words.get(at + 1).is_some_and(|word| word == name)
        });
        if let Some(at) = here {
            return Some((file, at));
        }
        let listed = words.windows(2).any(|two| two[0] == name && two[1] == "=");
        if listed && words.iter().any(|word| word == MACRO) {
            let at = words.windows(2).position(|two| two[0] == "struct" && two[1] == "name")?;
            return Some((file, at));
        }
        let (mut path, _) = brought(file).into_iter().find(|(_, called)| called == name)?;
        let last = path.pop()?;
        (path != module || last != name).then(|| self.definition(&path, &last))?
    }

    /// Everything public in the inherent `impl`s of a definition.
    fn methods(&self, of: (&File, usize), name: &str) -> Vec<String> {
        let mut found = Vec::new();
        for file in self.0.values() {
            let words = &file.words;
            for at in top(words).filter(|&at| words[at] == "impl") {
                let open = at + words[at..].iter().position(|word| word == "{").unwrap_or(0);
                let head = &words[at + 1..open];
                let own = if of.0.words[of.1 + 1] == "name" { ["name", name] } else { [name; 2] };
                let subject = head.iter().rev().find(|word| word.starts_with(is_word));
                let lifetime = head.iter().any(|word| word == "'");
                let subject = if lifetime { head.iter().find(|w| w.len() > 1) } else { subject };
                let Some(subject) = subject.filter(|word| own.contains(&&***word)) else {
                    continue;
                };
                if head.iter().any(|word| word == "for") {
                    continue;
                }
                let meant = match &**subject {
                    "name" => file.module == of.0.module,
                    _ => self
                        .definition(&file.module, subject)
                        .is_some_and(|(there, at)| (&there.module, at) == (&of.0.module, of.1)),
                };
                if meant {
                    found
                        .extend(items(words, open).into_iter().filter_map(|item| open_item(&item)));
                }
            }
        }
        found
    }

    /// A name and what can be seen of it.
    fn describe(&self, module: &[String], name: &str, out: &mut Vec<String>) {
        let of = self.definition(module, name);
        let (file, at) = of.unwrap_or_else(|| panic!("{}::{name} is defined", module.join("::")));
        let words = &file.words;
        let kind = &*words[at];
        let before = words[..at].rsplit(|word| [";", "}"].contains(&&**word)).next();
        let grows = before.is_some_and(|words| words.iter().any(|word| word == "non_exhaustive"));
        out.push(format!("{kind}{}", if grows { ", non_exhaustive" } else { "" }));
        match kind {
            "fn" | "const" => {
                let end = words[at..].iter().position(|word| ["{", "="].contains(&&**word));
                out.push(said(&words[at..at + end.expect("an item ends")]));
            }
            "struct" | "enum" => {
                let ends = ["{", ";", "("];
                let open = at + words[at..].iter().position(|w| ends.contains(&&**w)).unwrap_or(0);
                let parts = if words[open] == ";" { vec![] } else { items(words, open) };
                out.extend(parts.into_iter().filter_map(|part| match kind {
                    "enum" => Some(said(&without_attributes(&part))),
                    _ => open_item(&part),
                }));
            }
            "trait" => {
                let open = at + words[at..].iter().position(|word| word == "{").expect("a body");
                out.push(said(&words[at..open]));
                out.extend(items(words, open).iter().map(|item| {
                    let item = without_attributes(item);
                    let end = item.iter().position(|w| w == "{").unwrap_or(item.len());
                    said(&item[..end])
                }));
            }
            "type" => {
                let end = words[at..].iter().position(|word| word == ";");
                out.push(said(&words[at..at + end.expect("an item ends")]));
            }
            other => panic!("{name} is a {other}: say here what can be seen of it"),
        }
        out.extend(self.methods((file, at), &words[at + 1].replace("name", name)));
    }
}

/// Places of words outside of braces.
fn top(words: &[String]) -> impl Iterator<Item = usize> {
    let mut depth = 0usize;
    let in_macro = words.iter().any(|word| word == MACRO);
    words.iter().enumerate().filter_map(move |(at, word)| {
        match &**word {
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            _ => {}
        }
        // a macro's items lie within its own braces
        (depth == 0 || in_macro && depth <= 2).then_some(at)
    })
}

/// Every name that `use` brings into a file or, in src/lib.rs, that `pub use` brings to the face.
fn brought(file: &File) -> Vec<Brought> {
    let words = &file.words;
    let mut found = Vec::new();
    for at in (0..words.len()).filter(|&at| words[at] == "use") {
        tree(words, at + 1, &file.module, &mut found);
    }
    found
}

/// Reads a path, or a tree of paths in braces, from word `at` on; gives the word after it.
fn tree(words: &[String], mut at: usize, before: &[String], found: &mut Vec<Brought>) -> usize {
    let mut path = before.to_vec();
    loop {
        match &*words[at] {
            "crate" => path.clear(),
            "self" if words[at + 1] == "::" => {}
            "super" => drop(path.pop()),
            "{" => {
                at += 1;
                while words[at] != "}" {
                    at = if words[at] == "," { at + 1 } else { tree(words, at, &path, found) };
                }
                return at + 1;
            }
            name => path.push(name.to_owned()),
        }
        if words[at + 1] != "::" {
            break;
        }
        at += 2;
    }
    let renamed = words[at + 1] == "as";
    let called = words[if renamed { at + 2 } else { at }].clone();
    found.push((path, called));
    at + if renamed { 3 } else { 1 }
}

/// The face: module by module, its names and where they are from.
fn face(lib: &File) -> Vec<(String, Vec<Brought>)> {
    let words = &lib.words;
    let mut modules = vec![(String::new(), vec![])];
    let mut at = 0;
    while at < words.len() {
        match [&*words[at], words.get(at + 1).map_or("", |word| word)] {
            ["mod", name] if words[at + 2] == "{" => modules.push((format!("{name}::"), vec![])),
            // a wing is private but for the tests of this repository; `cli` is the program's
            ["mod", name] => {
                let open = words[at - 1] == "pub";
                let twin = words.windows(3).any(|w| w[0] != "pub" && w[1] == "mod" && w[2] == name);
                assert!(!open || twin || name == "cli", "`pub mod {name}` belongs to the face");
            }
            ["}", _] => modules.push((String::new(), vec![])),
            ["pub", "use"] => {
                let names = &mut modules.last_mut().expect("the root").1;
                at = tree(words, at + 2, &[], names);
            }
            _ => {}
        }
        at += 1;
    }
    modules
}

#[test]
fn the_face_is_what_it_was() {
    let all = Crate::read();
    let lib = File { module: vec![], words: all.0[""].words.clone() };
    let mut described = BTreeMap::new();
    for (module, names) in face(&lib) {
        for (mut path, called) in names {
            let (mut seen, name) = (Vec::new(), path.pop().expect("a path ends in a name"));
            all.describe(&path, &name, &mut seen);
            described.insert(format!("{module}{called}"), seen);
        }
    }
    let mut text = String::new();
    for (name, mut seen) in described {
        writeln!(text, "{name}: {}", seen.remove(0)).expect("text grows");
        seen.iter().for_each(|line| writeln!(text, "    {line}").expect("text grows"));
    }
    assert!(text.lines().count() > 100, "the face was found");
    expect_file!["../golden/api.txt"].assert_eq(&text);
}

#[test]
fn the_facade_is_played_by_names_of_the_face_alone() {
    let words: Vec<_> = tokens(&read("tests/it/facade/play.rs")).into_iter().map(|t| t.0).collect();
    let wings = ["num", "chip", "learn", "task", "lab", "cli"];
    let used: Vec<_> = words.windows(3).filter(|w| w[0] == "dalean" && w[1] == "::").collect();
    assert!(!used.is_empty() && used.iter().all(|w| !wings.contains(&&*w[2])));
}

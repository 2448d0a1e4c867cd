//! Reads Rust source as far as the house needs it: tokens, and the module paths that a file uses.

/// The text with comments, strings and characters blanked out; lines stay where they are.
fn code(text: &str) -> String {
    let s: Vec<char> = text.chars().collect();
    let at = |i: usize| s.get(i).copied().unwrap_or('\0');
    let mut out = String::with_capacity(text.len());
    let mut i = 0;
    while i < s.len() {
        let end = match (s[i], at(i + 1)) {
            ('/', '/') => (i..s.len()).find(|&j| s[j] == '\n').unwrap_or(s.len()),
            ('/', '*') => block_comment_end(&s, i),
            ('"', _) => string_end(&s, i + 1),
            ('r', '"' | '#')
                if !is_word(if i > 0 { s[i - 1] } else { ' ' }) || at(i - 1) == 'b' =>
            {
                raw_string_end(&s, i + 1).unwrap_or(i)
            }
            ('\'', '\\') => (i + 3..s.len()).find(|&j| s[j] == '\'').map_or(s.len(), |j| j + 1),
            ('\'', _) if at(i + 2) == '\'' => i + 3,
            _ => i,
        };
        if end > i {
            out.extend(s[i..end].iter().map(|&c| if c == '\n' { '\n' } else { ' ' }));
            i = end;
        } else {
            out.push(s[i]);
            i += 1;
        }
    }
    out
}

fn block_comment_end(s: &[char], start: usize) -> usize {
    let mut depth = 0;
    let mut i = start;
    while i < s.len() {
        match (s[i], s.get(i + 1)) {
            ('/', Some('*')) => (depth, i) = (depth + 1, i + 2),
            ('*', Some('/')) => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    i
}

fn string_end(s: &[char], mut i: usize) -> usize {
    while i < s.len() && s[i] != '"' {
        i += if s[i] == '\\' { 2 } else { 1 };
    }
    (i + 1).min(s.len())
}

/// End of a raw string whose hashes begin at `i`; `None` when there is none.
fn raw_string_end(s: &[char], i: usize) -> Option<usize> {
    let hashes = s[i..].iter().take_while(|&&c| c == '#').count();
    if s.get(i + hashes) != Some(&'"') {
        return None; // a raw identifier
    }
    let closes = |j: usize| s[j] == '"' && s[j + 1..].iter().take(hashes).all(|&c| c == '#');
    let end = (i + hashes + 1..s.len()).find(|&j| closes(j))?;
    Some((end + 1 + hashes).min(s.len()))
}

pub(super) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Words, `::` and single characters, each with its line.
pub(super) fn tokens(text: &str) -> Vec<(String, usize)> {
    let mut out: Vec<(String, usize)> = Vec::new();
    for (line, text) in code(text).lines().enumerate() {
        let mut rest = text.trim_start();
        while let Some(first) = rest.chars().next() {
            let length = if is_word(first) {
                rest.find(|c| !is_word(c)).unwrap_or(rest.len())
            } else if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            out.push((rest[..length].to_owned(), line + 1));
            rest = rest[length..].trim_start();
        }
    }
    out
}

/// Module path of a file: `src/chip/engine/forward.rs` is `chip`, `engine`, `forward`.
pub(super) fn module_of(path: &str) -> Vec<String> {
    let inner = path.trim_start_matches("src/").trim_end_matches(".rs");
    match inner {
        "lib" | "main" => vec![],
        _ => inner.split('/').map(str::to_owned).collect(),
    }
}

/// Every path in a file that starts at `crate`, `super` or `self`, from the root of the crate, with its line.
pub(super) fn reaches(path: &str, text: &str) -> Vec<(Vec<String>, usize)> {
    let tokens = tokens(text);
    let word = |i: usize| tokens.get(i).map_or("", |(word, _)| &**word);
    let mut here = module_of(path);
    let mut scopes: Vec<bool> = Vec::new();
    let mut found = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        match word(i) {
            "{" => {
                let is_module = i >= 2 && word(i - 2) == "mod";
                if is_module {
                    here.push(word(i - 1).to_owned());
                }
                scopes.push(is_module);
            }
            "}" if scopes.pop() == Some(true) => {
                here.pop();
            }
            "crate" | "super" | "self"
                if word(i + 1) == "::" && (i == 0 || word(i - 1) != "::") =>
            {
                let line = tokens[i].1;
                let mut ends = Vec::new();
                let next = tree(&tokens, i, &[], &mut ends);
                found.extend(ends.iter().map(|end| (absolute(&here, end), line)));
                i = next;
                continue;
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// Reads a path, or a tree of paths in braces, from token `i` on; gives the token after it.
fn tree(
    tokens: &[(String, usize)],
    mut i: usize,
    before: &[String],
    ends: &mut Vec<Vec<String>>,
) -> usize {
    let word = |i: usize| tokens.get(i).map_or("", |(word, _)| &**word);
    let mut path = before.to_vec();
    loop {
        match word(i) {
            "{" if word(i.wrapping_sub(1)) == "::" => {
                i += 1;
                while word(i) != "}" && i < tokens.len() {
                    i = match word(i) {
                        "," => i + 1,
                        _ => tree(tokens, i, &path, ends),
                    };
                }
                return i + 1;
            }
            name if name.starts_with(is_word) => path.push(name.to_owned()),
            _ => {}
        }
        i += 1;
        if word(i) == "::" && (word(i + 1) == "{" || word(i + 1).starts_with(is_word)) {
            i += 1;
        } else {
            // what follows a name in a tree: `as other`
            while !before.is_empty() && !matches!(word(i), "," | "}" | "") {
                i += 1;
            }
            ends.push(path);
            return i;
        }
    }
}

fn absolute(here: &[String], path: &[String]) -> Vec<String> {
    let mut base = if path[0] == "crate" { vec![] } else { here.to_vec() };
    for name in path {
        match &**name {
            "crate" | "self" => {}
            "super" => {
                base.pop();
            }
            _ => base.push(name.clone()),
        }
    }
    base
}

#[test]
fn comments_strings_and_characters_are_not_code() {
    let text =
        "a // b\n/* c /* d */ e */ f \"g \\\" h\" r#\"i \" j\"# '\\'' 'k' &'l m b\"n\" br\"o\"";
    let words: Vec<_> = tokens(text).into_iter().map(|(word, _)| word).collect();
    assert_eq!(words, ["a", "f", "&", "'", "l", "m", "b", "b"]);
}

#[test]
fn paths_are_read_through_trees_supers_and_inner_modules() {
    let text = "use super::hardware::{Adc, self as h, x::{Y, Z}};\n\
                mod tests { use super::super::Engine; fn f() { crate::num::fixed::rsh::<u8>(1); } }\n\
                pub(super) fn g() { self::h() }";
    let found: Vec<_> = reaches("src/chip/engine/forward.rs", text)
        .into_iter()
        .map(|(path, line)| format!("{} {line}", path.join("::")))
        .collect();
    let wanted = [
        "chip::engine::hardware::Adc 1",
        "chip::engine::hardware 1",
        "chip::engine::hardware::x::Y 1",
        "chip::engine::hardware::x::Z 1",
        "chip::engine::Engine 2",
        "num::fixed::rsh 2",
        "chip::engine::forward::h 3",
    ];
    assert_eq!(found, wanted);
}

//! Items of Rust source, as words: fields, variants, methods.

use super::source::is_word;

/// The words without what is there for tests alone.
pub(super) fn without_tests(words: Vec<String>) -> Vec<String> {
    let test = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < words.len() {
        let is_test = words[at..].iter().take(test.len()).eq(&test);
        at += if is_test { test.len() } else { 0 };
        if !is_test {
            kept.push(words[at].clone());
            at += 1;
            continue;
        }
        at = end_of_item(&words, at);
    }
    kept
}

/// The place behind an item, variant or arm that begins somewhere.
fn end_of_item(words: &[String], mut at: usize) -> usize {
    let (mut depth, mut angles) = (0, 0);
    while at < words.len() {
        match &*words[at] {
            "<" if depth == 0 => angles += 1,
            ">" if depth == 0 && words[at - 1] != "-" => angles -= 1,
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" if depth == 0 => return at,
            "}" if depth == 1 => {
                let more = words.get(at + 1).is_some_and(|word| [",", ";"].contains(&&**word));
                return at + 1 + usize::from(more);
            }
            "}" | ")" | "]" => depth -= 1,
            "," if depth == 0 && angles == 0 => return at + 1,
            ";" if depth == 0 => return at + 1,
            _ => {}
        }
        at += 1;
    }
    at
}

/// What lies between the bracket at `open` and the one that closes it, item by item.
pub(super) fn items(words: &[String], open: usize) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut at = open + 1;
    while !matches!(&*words[at], "}" | ")") {
        let end = end_of_item(words, at);
        found.push(words[at..end].to_vec());
        at = end;
    }
    found
}

/// An item without what stands in `#[...]` before it.
pub(super) fn without_attributes(item: &[String]) -> Vec<String> {
    let mut depth = 0;
    let mut kept = Vec::new();
    for (at, word) in item.iter().enumerate() {
        let inside = depth > 0;
        match &**word {
            "[" if inside || at > 0 && item[at - 1] == "#" => depth += 1,
            "]" if inside => depth -= 1,
            "#" => {}
            _ if inside => {}
            _ => kept.push(word.clone()),
        }
    }
    kept
}

/// A field, method or constant, if all may use it.
pub(super) fn open_item(item: &[String]) -> Option<String> {
    let item = without_attributes(item);
    let public = item.first()? == "pub" && item.get(1)? != "(";
    let is_constant = item.get(3).is_some_and(|word| word == ":") && item[1] == "const";
    let end = if is_constant { "=" } else { "{" };
    let end = item.iter().position(|word| word == end).unwrap_or(item.len());
    public.then(|| said(&item[1..end]))
}

/// Words as they are written.
pub(super) fn said(words: &[String]) -> String {
    let mut text = String::new();
    for word in words {
        let last = text.chars().next_back().unwrap_or(' ');
        let joined = is_word(last) && word.starts_with(is_word);
        let apart = [',', ':', ';', '='].contains(&last) && !text.ends_with("::");
        let arrow = word == "-" || word == "{" || last == '{' || text.ends_with("->");
        if joined || apart && word != ":" || arrow && !text.is_empty() {
            text.push(' ');
        }
        text += word;
    }
    text.trim_end_matches([',', ';']).trim_end().to_owned()
}

//! Conditions on axes: `bits >= 2 || rounding == "stochastic"`.
//!
//! ```text
//! condition  = or        or = and { "||" and }        and = equal { "&&" equal }
//! equal      = in { ("==" | "!=") in }                in  = order [ "in" order ]
//! order      = sum [ ("<" | "<=" | ">" | ">=") sum ]  sum = product { ("+" | "-") product }
//! product    = power { ("*" | "/" | "%") power }      power = sign [ "**" power ]
//! sign       = ("!" | "-" | "+") sign | value
//! value      = number | "text" | true | false | name | ( condition ) | [ condition, ... ]
//! ```
//!
//! Arithmetic and comparison, and nothing that could wait, grow or read a file: a condition is a tree of bounded depth
//! over bounded text, so that it takes no more time and memory than it has characters. Whole numbers stay whole (`7 / 2`
//! is 3) and never wrap; things of different kinds are not equal, and have no order.

mod evaluate;
mod parse;

use super::SweepError;
use super::axis::Value;
use evaluate::Cell;
use parse::Tree;

/// Most bytes of a condition.
const TEXT_MAX: usize = 4096;
/// Most conditions of a sweep.
const CONDITIONS_MAX: usize = 256;

/// What is wrong with a condition, and at which byte of it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Fault {
    at: usize,
    what: String,
}

impl Fault {
    fn new(at: usize, what: impl Into<String>) -> Self {
        Self { at, what: what.into() }
    }
}

/// Conditions, read.
#[derive(Debug)]
pub(super) struct Filter {
    conditions: Vec<(String, Tree)>,
}

/// The condition with a caret under what is wrong.
fn wrong(text: &str, fault: &Fault, names: &[&str]) -> SweepError {
    // a caret counts characters, and a line that is cut stands for itself
    let before = text.get(..fault.at).unwrap_or(text);
    let column = before.chars().rev().take_while(|&c| c != '\n').count();
    let line = text.split('\n').nth(before.matches('\n').count()).unwrap_or(text);
    let caret = " ".repeat(column);
    SweepError::Filter {
        text: text.into(),
        error: format!("{}\n  {line}\n  {caret}^\n", fault.what),
        names: names.join(", "),
    }
}

impl Filter {
    /// Reads conditions on columns of these names.
    pub(super) fn new(texts: &[String], names: &[&str]) -> Result<Self, SweepError> {
        if texts.len() > CONDITIONS_MAX {
            let found = format!("holds {} conditions", texts.len());
            let allowed = format!("give at most {CONDITIONS_MAX}: join them with &&");
            return Err(SweepError::key("filter", &found, &allowed));
        }
        let read = |text: &String| {
            if text.len() > TEXT_MAX {
                let found = format!("holds a condition of {} bytes", text.len());
                let allowed = format!("a condition has at most {TEXT_MAX}");
                return Err(SweepError::key("filter", &found, &allowed));
            }
            let tree = parse::read(text, names).map_err(|fault| wrong(text, &fault, names))?;
            Ok((text.clone(), tree))
        };
        Ok(Self { conditions: texts.iter().map(read).collect::<Result<_, _>>()? })
    }

    /// Whether values meet every condition.
    pub(super) fn passes(&self, names: &[&str], values: &[Value]) -> Result<bool, SweepError> {
        for (text, tree) in &self.conditions {
            let found = evaluate::evaluate(tree, values);
            let found = found.and_then(|found| match found {
                Cell::Flag(passes) => Ok(passes),
                other => Err(Fault::new(0, format!("it gives {other}, not true or false"))),
            });
            if !found.map_err(|fault| wrong(text, &fault, names))? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passes(text: &str) -> Result<bool, String> {
        let names = ["bits", "rate", "rule", "on"];
        let values =
            [Value::Whole(4), Value::Real(2.0), Value::Text("ed".into()), Value::Flag(true)];
        Filter::new(&[text.into()], &names)
            .and_then(|filter| filter.passes(&names, &values))
            .map_err(|e| e.to_string())
    }

    #[test]
    fn conditions_compare_numbers_and_words() {
        for (text, wanted) in [
            ("bits >= 4 && rule == \"ed\"", true),
            ("bits > 4 || rule != \"ed\"", false),
            ("bits * 2 == 8", true),
            ("rate < bits", true),
            ("rule in [\"dfa\", \"bp\"]", false),
            ("rule in [\"dfa\", 'bp', `ed`]", true),
            ("bits in [1, 2.0, 4.0]", true),
            ("\"e\" in rule", true),
            // whole numbers stay whole, as they always did here
            ("7 / 2 == 3 && -7 / 2 == -3 && 7 % 4 == 3 && 2 ** 3 ** 2 == 512", true),
            ("7 / 2.0 == 3.5", true),
            ("1 + 2 * 3 - 4 == 3 && (1 + 2) * 3 == 9", true),
            ("!on || !!on && on", true),
            ("on == true && on != false", true),
            ("-bits + +bits == 0", true),
            ("rate == 2 && rate <= 2 && rate >= 1.5e0 && 1_000 == 1e3", true),
            // an axis may hold numbers and words: they are never equal
            ("rule == 4", false),
            ("rule != 4", true),
            ("rule < \"zz\" && rule >= \"ed\"", true),
            ("\"a\\\"b\\\\\" == 'a\"b\\\\'", true),
            ("bits == 4 // what comes behind says why\n&& on", true),
            // what need not be asked is not asked
            ("on || 1 / 0 == 1", true),
            ("!on && 1 / 0 == 1", false),
        ] {
            assert_eq!(passes(text), Ok(wanted), "{text}");
        }
    }

    #[test]
    fn mistakes_show_the_condition_the_place_and_the_names() {
        for (text, at, what) in [
            ("bit > 1", 0, "`bit` is no axis"),
            ("bits >", 6, "a value is missing"),
            ("bits + 1", 0, "it gives 5, not true or false"),
            ("bits = 3", 5, "compare with =="),
            ("while true {}", 11, "`{` is nothing here"),
            ("bits > 3)", 8, "nothing is open"),
            ("(bits > 3", 9, "`)` is missing"),
            ("bits in [1, 2", 13, "`]` is missing"),
            ("rule < 3", 5, "have no order"),
            ("rule * 2 == 1", 5, "numbers"),
            ("bits / 0 == 1", 5, "divides by 0"),
            ("9223372036854775807 + bits > 0", 20, "too large"),
            ("bits ** 99 > 0", 5, "too large"),
            ("92233720368547758080 > 0", 0, "no number"),
            ("bits && true", 5, "true or false"),
            ("!bits", 0, "true or false"),
            ("\"open", 0, "`\"` is missing"),
            ("bits > 1 & on", 9, "&&"),
            ("eval(\"1\")", 0, "`eval` is no axis"),
            ("\"a\".pad(1000000000, \"b\") == rule", 3, "`.`"),
            ("bits > 3 ; on", 9, "`;`"),
            ("1 < 2 < 3", 6, "another order"),
            ("[1] == [1]", 0, "a list stands behind `in`"),
            ("", 0, "a value is missing"),
        ] {
            let error = passes(text).unwrap_err();
            assert!(error.contains(text) && error.contains("bits, rate, rule"), "{text}: {error}");
            assert!(error.contains(what), "{text}: {error}");
            let caret = format!("\n  {}^\n", " ".repeat(at));
            assert!(error.contains(&caret), "{text}: {error}");
        }
    }

    #[test]
    fn no_condition_takes_memory_or_time_without_bound() {
        let deep = |open: &str, n: usize, close: &str| {
            format!("{}true{}", open.repeat(n), close.repeat(n))
        };
        for (open, close) in [("(", ")"), ("!", ""), ("[", "]"), ("- ", "")] {
            let error = passes(&deep(open, 1500, close)).unwrap_err();
            assert!(error.contains("deep"), "{open}: {error}");
        }
        assert_eq!(passes(&deep("(", 40, ")")), Ok(true));
        // a chain is not deep
        let chain = |part: &str, n: usize, end: &str| passes(&(part.repeat(n) + end));
        assert_eq!(chain("bits + ", 500, "bits > 0"), Ok(true));
        assert_eq!(chain("on && ", 600, "on"), Ok(true));
        let error = chain("2 ** ", 400, "2 > 0").unwrap_err();
        assert!(error.contains("deep"), "{error}");
        let error = chain("on && ", 5000, "on").unwrap_err();
        assert!(error.contains("at most 4096"), "{error}");
        let many = vec!["true".to_owned(); 1000];
        assert!(Filter::new(&many, &["bits"]).unwrap_err().to_string().contains("at most 256"));
    }
}

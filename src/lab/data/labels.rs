//! From labels as they stand in files to classes 0, 1, 2, ...: one law for all parts of a set.
//!
//! ```text
//! the labels that occur are 0 .. n-1              class = label
//! anything else (1 .. 26, -1 and +1, text)        class = place among the different labels of all parts, in rising
//!                                                 order (numbers by size, text by code point); the labels become
//!                                                 the names of the classes
//! `classes` is stated                             class = label where every label lies below it, else as above
//! ```
//!
//! `classes` says that a class may lack training examples, and that there may be few examples a class.

use std::collections::BTreeMap;
use std::fmt;

/// Most classes.
const CLASSES_MAX: usize = 256;
/// Names told in a message.
const TOLD: usize = 6;

/// A label as it stands in a file. Numbers come before text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Label {
    /// A whole number, whatever its type was.
    Number(i64),
    /// Anything else.
    Text(String),
}

impl Label {
    /// What a number says; `None` when it is no whole one.
    #[must_use]
    pub fn of_float(x: f64) -> Option<Self> {
        // a whole number below 2^51 stands in the last bits of its sum with 1.5 x 2^52
        const SHIFT: f64 = 6_755_399_441_055_744.0;
        let bits = |x: f64| x.to_bits().cast_signed();
        let whole = x.fract() == 0.0 && x.abs() < 2_251_799_813_685_248.0;
        whole.then(|| Self::Number(bits(x + SHIFT) - bits(SHIFT)))
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// The labels of a part: the different ones in rising order, and of each example which.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    /// Different labels, in rising order.
    pub distinct: Vec<Label>,
    /// One an example: a place in `distinct`.
    pub of: Vec<u32>,
}

impl FromIterator<Label> for Labels {
    fn from_iter<I: IntoIterator<Item = Label>>(labels: I) -> Self {
        let mut known: BTreeMap<Label, u32> = BTreeMap::new();
        let mut of = Vec::new();
        for label in labels {
            let next = u32::try_from(known.len()).unwrap_or(u32::MAX);
            of.push(*known.entry(label).or_insert(next));
        }
        let mut place = vec![0; known.len()];
        for (rank, met) in (0u32..).zip(known.values()) {
            place[*met as usize] = rank;
        }
        of.iter_mut().for_each(|label| *label = place[*label as usize]);
        Self { distinct: known.into_keys().collect(), of }
    }
}

/// Why labels are no classes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LabelsError {
    /// One class.
    #[error(
        "all {examples} labels are `{label}`: with one class there is nothing to tell apart; name the column or \
         array that holds the classes, or add examples of another"
    )]
    One {
        /// The label.
        label: Label,
        /// So many of it.
        examples: usize,
    },
    /// More classes than there may be.
    #[error(
        "there are {found} different labels ({}), at most {CLASSES_MAX} classes can be told apart; if this is a \
         measurement or a number of the row, name another column or array for the label", told(.some)
    )]
    Many {
        /// Different labels.
        found: usize,
        /// The first of them.
        some: Vec<Label>,
    },
    /// Hardly two examples of a class.
    #[error(
        "{examples} training examples have {found} different labels ({}): fewer than two examples a class look \
         like a measurement or a number of the row; name another column or array for the label, or say \
         data.classes = {found} if it is meant", told(.some)
    )]
    Rare {
        /// Training examples.
        examples: usize,
        /// Different labels.
        found: usize,
        /// The first of them.
        some: Vec<Label>,
    },
    /// Labels that training never shows.
    #[error(
        "the {part} part has the label `{label}`, of which the training part has no example; mend the labels, or \
         say data.classes = {classes} if it is meant"
    )]
    Untrained {
        /// Which part.
        part: &'static str,
        /// The label.
        label: Label,
        /// Number of classes that takes it in.
        classes: usize,
    },
    /// Labels that the stated number of classes does not fit.
    #[error(
        "there are {found} different labels, {} to {}, which are no {classes} classes; take `classes` out to \
         count the labels, or say data.classes = {allowed}", .ends[0], .ends[1]
    )]
    Classes {
        /// Different labels.
        found: usize,
        /// Least and greatest.
        ends: [Label; 2],
        /// Stated.
        classes: usize,
        /// What would do.
        allowed: usize,
    },
    /// Numbers in one part, text in another.
    #[error(
        "the labels of the training part are {train} (`{first}`), those of the {part} part are {other} (`{second}`); \
         write all parts alike"
    )]
    Kinds {
        /// Which part differs.
        part: &'static str,
        /// What the training part has.
        train: &'static str,
        /// What this part has.
        other: &'static str,
        /// A training label.
        first: Label,
        /// A label of the part.
        second: Label,
    },
}

fn told(labels: &[Label]) -> String {
    let mut text: Vec<_> = labels.iter().take(TOLD).map(ToString::to_string).collect();
    if labels.len() > TOLD {
        text.push("...".into());
    }
    text.join(", ")
}

/// What labels mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Classes {
    /// How many there are.
    pub count: usize,
    /// What they are called; empty when the labels are the numbers of the classes.
    pub names: Vec<String>,
    /// Labels of each part, by class.
    pub labels: Vec<Vec<u8>>,
}

/// Gives labels their classes: training part first, each part with its name.
///
/// # Errors
/// When they are no classes, or `stated` does not fit them.
pub fn classes(
    parts: &[(&'static str, &Labels)],
    stated: Option<usize>,
) -> Result<Classes, LabelsError> {
    let Some(&(_, train)) = parts.first() else {
        return Ok(Classes { count: stated.unwrap_or(1), names: vec![], labels: vec![] });
    };
    let text = |labels: &Labels| labels.distinct.iter().any(|l| matches!(l, Label::Text(_)));
    let any_text = text(train);
    for &(part, labels) in &parts[1..] {
        if text(labels) != any_text {
            let word = |text| if text { "text" } else { "numbers" };
            let example = |l: &Labels| l.distinct.last().cloned().unwrap_or(Label::Number(0));
            return Err(LabelsError::Kinds {
                part,
                train: word(any_text),
                other: word(!any_text),
                first: example(train),
                second: example(labels),
            });
        }
    }
    let mut all: Vec<Label> =
        parts.iter().flat_map(|(_, labels)| labels.distinct.iter().cloned()).collect();
    all.sort();
    all.dedup();
    let (least, greatest) = (all.first(), all.last());
    let found = all.len();
    let plain = |n: usize| {
        let below =
            |l: &Label| matches!(l, Label::Number(x) if usize::try_from(*x).is_ok_and(|x| x < n));
        all.iter().all(below)
    };
    let (count, numbers) = match stated {
        None => (found, plain(found)),
        Some(n) if plain(n) => (n, true),
        // text has no numbers that leave a gap
        Some(n) if n == found || (any_text && n > found) => (n, false),
        Some(n) => {
            let end = |label: Option<&Label>| label.cloned().unwrap_or(Label::Number(0));
            let ends = [end(least), end(greatest)];
            let allowed = match &ends[1] {
                Label::Number(top) if ends[0] >= Label::Number(0) => {
                    usize::try_from(*top).map_or(found, |top| top.saturating_add(1))
                }
                _ => found,
            };
            let allowed = if allowed > CLASSES_MAX { found } else { allowed };
            return Err(LabelsError::Classes { found, ends, classes: n, allowed });
        }
    };
    let examples = train.of.len();
    let some = || all.iter().take(TOLD + 1).cloned().collect::<Vec<_>>();
    if found > CLASSES_MAX {
        // rows that are nearly all different are no classes at all
        return Err(LabelsError::Many { found, some: some() });
    }
    if stated.is_none() {
        if let [label] = &all[..] {
            return Err(LabelsError::One { label: label.clone(), examples });
        }
        let different = train.distinct.len();
        if different > 2 && different.saturating_mul(2) > examples {
            return Err(LabelsError::Rare { examples, found: different, some: some() });
        }
        for &(part, labels) in &parts[1..] {
            if let Some(label) =
                labels.distinct.iter().find(|l| train.distinct.binary_search(l).is_err())
            {
                return Err(LabelsError::Untrained { part, label: label.clone(), classes: found });
            }
        }
    } else if count < 2 {
        let label = least.cloned().unwrap_or(Label::Number(0));
        return Err(LabelsError::One { label, examples });
    }
    let class = |label: &Label| match label {
        Label::Number(x) if numbers => u8::try_from(*x).expect("below the count, at most 256"),
        label => {
            let at = all.binary_search(label).expect("the label of a part");
            u8::try_from(at).expect("at most 256 different labels")
        }
    };
    let of_part = |labels: &Labels| -> Vec<u8> {
        let table: Vec<u8> = labels.distinct.iter().map(class).collect();
        labels.of.iter().map(|&at| table[at as usize]).collect()
    };
    let mut names: Vec<String> =
        if numbers { vec![] } else { all.iter().map(ToString::to_string).collect() };
    if !numbers {
        names.extend((found..count).map(|class| format!("(class {class})")));
    }
    Ok(Classes { count, names, labels: parts.iter().map(|(_, l)| of_part(l)).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(labels: &[i64]) -> Labels {
        labels.iter().copied().map(Label::Number).collect()
    }

    fn words(labels: &[&str]) -> Labels {
        labels.iter().map(|&word| Label::Text(word.into())).collect()
    }

    fn of(train: &Labels, test: &Labels, stated: Option<usize>) -> Result<Classes, String> {
        classes(&[("training", train), ("test", test)], stated).map_err(|e| e.to_string())
    }

    #[test]
    fn labels_become_classes_in_rising_order_and_keep_their_names() {
        let two = |labels: Labels| of(&labels, &labels, None).unwrap();
        let plain = two(numbers(&[1, 0, 1, 0]));
        assert_eq!((plain.count, &plain.labels[0][..]), (2, &[1, 0, 1, 0][..]));
        assert!(plain.names.is_empty());
        let signed = two(numbers(&[1, -1, 1, -1]));
        assert_eq!(
            (&signed.labels[0][..], &signed.names[..]),
            (&[1, 0, 1, 0][..], &["-1".to_owned(), "1".to_owned()][..])
        );
        let gaps = two(numbers(&[10, 9, 30, 30, 9, 10]));
        assert_eq!(gaps.labels[0], [1, 0, 2, 2, 0, 1]);
        assert_eq!(gaps.names, ["9", "10", "30"]);
        let text = two(words(&["dog", "cat", "dog", "cat"]));
        assert_eq!(
            (&text.labels[1][..], text.names),
            (&[1, 0, 1, 0][..], vec!["cat".to_owned(), "dog".into()])
        );
    }

    #[test]
    fn a_stated_number_of_classes_keeps_labels_that_lie_below_it() {
        let labels = numbers(&[1, 3, 1, 3]);
        let all = |n| of(&labels, &labels, Some(n)).map(|c| (c.count, c.labels[0].clone()));
        assert_eq!(all(4), Ok((4, vec![1, 3, 1, 3])));
        assert_eq!(all(2), Ok((2, vec![0, 1, 0, 1])));
        assert!(all(3).unwrap_err().contains("say data.classes = 4"), "{:?}", all(3));
        let one = numbers(&[0, 0]);
        assert_eq!(of(&one, &one, Some(2)).unwrap().count, 2);
        let cats = words(&["a", "b", "a"]);
        assert!(of(&cats, &cats, Some(1)).unwrap_err().contains("say data.classes = 2"));
        assert_eq!(of(&cats, &cats, Some(3)).unwrap().names[2], "(class 2)");
    }

    #[test]
    fn what_cannot_be_classes_is_refused_with_what_it_is() {
        let same = |l: &Labels| of(l, l, None).unwrap_err();
        assert!(same(&numbers(&[3, 3, 3])).contains("all 3 labels are `3`"));
        let rows: Vec<i64> = (0..300).map(|row| row * 2 / 3).collect();
        assert!(same(&numbers(&rows)).contains("300 training examples have 200 different labels"));
        let many: Vec<i64> = (0..1000).map(|row| row % 300).collect();
        assert!(same(&numbers(&many)).contains("300 different labels (0, 1, 2, 3, 4, 5, ...)"));
        let (train, test) = (numbers(&[0, 1, 0, 1]), numbers(&[2]));
        assert!(of(&train, &test, None).unwrap_err().contains("the test part has the label `2`"));
        let error = of(&train, &words(&["one"]), None).unwrap_err();
        assert!(error.contains("numbers (`1`)") && error.contains("text (`one`)"), "{error}");
    }

    #[test]
    fn whole_floats_are_labels_and_fractions_are_not() {
        assert_eq!(Label::of_float(3.0), Some(Label::Number(3)));
        assert_eq!(Label::of_float(-1.0), Some(Label::Number(-1)));
        for x in [3.5, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(Label::of_float(x), None);
        }
    }
}

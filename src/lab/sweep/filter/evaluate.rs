//! What a tree gives for the values of a point.

use std::cmp::Ordering;
use std::fmt;

use super::Fault;
use super::parse::{Between, Node, Tree};
use crate::lab::sweep::axis::Value;

/// A value on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell<'a> {
    Whole(i64),
    Real(f64),
    Flag(bool),
    Text(&'a str),
}

impl fmt::Display for Cell<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(value) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
            Self::Flag(value) => value.fmt(f),
            Self::Text(text) => write!(f, "\"{text}\""),
        }
    }
}

impl Cell<'_> {
    fn number(self) -> Option<f64> {
        match self {
            Self::Whole(value) => Some(value as f64),
            Self::Real(value) => Some(value),
            Self::Flag(_) | Self::Text(_) => None,
        }
    }

    /// Whether two are the same; never of different kinds.
    fn is(self, other: Self) -> bool {
        match (self, other) {
            (Self::Whole(a), Self::Whole(b)) => a == b,
            (Self::Flag(a), Self::Flag(b)) => a == b,
            (Self::Text(a), Self::Text(b)) => a == b,
            (a, b) => a.number().zip(b.number()).is_some_and(|(a, b)| a == b),
        }
    }

    fn order(self, other: Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Whole(a), Self::Whole(b)) => Some(a.cmp(&b)),
            (Self::Text(a), Self::Text(b)) => Some(a.cmp(b)),
            (a, b) => a.number().zip(b.number()).and_then(|(a, b)| a.partial_cmp(&b)),
        }
    }
}

/// What a tree gives, or where it fails.
pub(super) fn evaluate<'a>(tree: &'a Tree, values: &'a [Value]) -> Result<Cell<'a>, Fault> {
    let at = tree.at;
    Ok(match &tree.node {
        Node::Whole(value) => Cell::Whole(*value),
        Node::Real(value) => Cell::Real(*value),
        Node::Flag(value) => Cell::Flag(*value),
        Node::Text(text) => Cell::Text(text),
        Node::Column(column) => match &values[*column] {
            Value::Whole(value) => Cell::Whole(*value),
            Value::Real(value) => Cell::Real(*value),
            Value::Flag(value) => Cell::Flag(*value),
            Value::Text(text) => Cell::Text(text),
        },
        Node::List(_) => return Err(Fault::new(at, "a list stands behind `in`")),
        Node::Not(of) => Cell::Flag(!flag(evaluate(of, values)?, at, "!")?),
        Node::Negative(of) => match evaluate(of, values)? {
            Cell::Whole(value) => Cell::Whole(value.checked_neg().ok_or_else(|| too_large(at))?),
            Cell::Real(value) => Cell::Real(-value),
            other => return Err(Fault::new(at, format!("- takes numbers, not {other}"))),
        },
        Node::Chain(first, more) => {
            let mut left = evaluate(first, values)?;
            for (between, at, right) in more {
                left = both(left, *between, *at, right, values)?;
            }
            left
        }
    })
}

fn too_large(at: usize) -> Fault {
    Fault::new(at, "the result is too large for 64 bits; write a number with a point, such as 2.0")
}

fn flag(cell: Cell<'_>, at: usize, sign: &str) -> Result<bool, Fault> {
    match cell {
        Cell::Flag(value) => Ok(value),
        other => Err(Fault::new(at, format!("{sign} takes true or false, not {other}"))),
    }
}

fn both<'a>(
    left: Cell<'a>,
    between: Between,
    at: usize,
    right: &'a Tree,
    values: &'a [Value],
) -> Result<Cell<'a>, Fault> {
    let sign = between.sign();
    match between {
        // the right side is asked only where it decides
        Between::Or | Between::And => {
            let decided = flag(left, at, sign)?;
            if decided == (between == Between::Or) {
                return Ok(left);
            }
            return Ok(Cell::Flag(flag(evaluate(right, values)?, at, sign)?));
        }
        Between::In => return is_in(left, at, right, values).map(Cell::Flag),
        _ => {}
    }
    let right = evaluate(right, values)?;
    let flag = match between {
        Between::Equal => left.is(right),
        Between::Unequal => !left.is(right),
        Between::Less | Between::LessOrEqual | Between::Greater | Between::GreaterOrEqual => {
            let order = left.order(right);
            let none = || Fault::new(at, format!("{left} and {right} have no order"));
            let order = order.ok_or_else(none)?;
            match between {
                Between::Less => order.is_lt(),
                Between::LessOrEqual => order.is_le(),
                Between::Greater => order.is_gt(),
                _ => order.is_ge(),
            }
        }
        _ => return arithmetic(left, between, at, right),
    };
    Ok(Cell::Flag(flag))
}

fn is_in(left: Cell<'_>, at: usize, right: &Tree, values: &[Value]) -> Result<bool, Fault> {
    if let Node::List(list) = &right.node {
        for one in list {
            if left.is(evaluate(one, values)?) {
                return Ok(true);
            }
        }
        return Ok(false);
    }
    match (left, evaluate(right, values)?) {
        (Cell::Text(part), Cell::Text(whole)) => Ok(whole.contains(part)),
        (left, right) => {
            let what =
                format!("{left} in {right}: behind `in` stands a list, such as [1, 2], or a text");
            Err(Fault::new(at, what))
        }
    }
}

fn arithmetic<'a>(
    left: Cell<'a>,
    between: Between,
    at: usize,
    right: Cell<'a>,
) -> Result<Cell<'a>, Fault> {
    if let (Cell::Whole(a), Cell::Whole(b)) = (left, right) {
        if matches!(between, Between::Over | Between::Remainder) && b == 0 {
            return Err(Fault::new(at, "divides by 0"));
        }
        let found = match between {
            Between::Plus => a.checked_add(b),
            Between::Minus => a.checked_sub(b),
            Between::Times => a.checked_mul(b),
            Between::Over => a.checked_div(b),
            Between::Remainder => a.checked_rem(b),
            _ => u32::try_from(b).ok().and_then(|b| a.checked_pow(b)),
        };
        return found.map(Cell::Whole).ok_or_else(|| too_large(at));
    }
    let Some((a, b)) = left.number().zip(right.number()) else {
        let sign = between.sign();
        return Err(Fault::new(at, format!("{sign} takes numbers, not {left} and {right}")));
    };
    Ok(Cell::Real(match between {
        Between::Plus => a + b,
        Between::Minus => a - b,
        Between::Times => a * b,
        Between::Over => a / b,
        Between::Remainder => a % b,
        _ => libm::pow(a, b),
    }))
}

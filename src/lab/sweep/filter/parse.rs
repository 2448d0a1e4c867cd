//! From text to a tree.

use super::Fault;

/// How deep a condition may be nested.
const DEPTH_MAX: usize = 64;

/// What stands between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Between {
    Or,
    And,
    Equal,
    Unequal,
    In,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Plus,
    Minus,
    Times,
    Over,
    Remainder,
    Power,
}

impl Between {
    /// As it is written.
    pub(super) const fn sign(self) -> &'static str {
        match self {
            Self::Or => "||",
            Self::And => "&&",
            Self::Equal => "==",
            Self::Unequal => "!=",
            Self::In => "in",
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
            Self::Plus => "+",
            Self::Minus => "-",
            Self::Times => "*",
            Self::Over => "/",
            Self::Remainder => "%",
            Self::Power => "**",
        }
    }
}

/// A condition, or a part of one; `at` is its first byte.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tree {
    pub(super) at: usize,
    pub(super) node: Node,
}

/// What a part is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Node {
    Whole(i64),
    Real(f64),
    Flag(bool),
    Text(String),
    /// The value of a column.
    Column(usize),
    List(Vec<Tree>),
    Not(Box<Tree>),
    Negative(Box<Tree>),
    /// Values with what stands before each but the first, and where: applied from the left.
    Chain(Box<Tree>, Vec<(Between, usize, Tree)>),
}

/// A word of the language.
#[derive(Debug, Clone, PartialEq)]
enum Token {
    Whole(i64),
    Real(f64),
    Text(String),
    Name(String),
    Sign(&'static str),
    End,
}

/// Signs, longer ones first.
const SIGNS: [&str; 19] = [
    "||", "&&", "==", "!=", "<=", ">=", "**", "<", ">", "+", "-", "*", "/", "%", "!", "(", ")",
    "[", "]",
];

/// Reads a condition on columns of these names.
pub(super) fn read(text: &str, names: &[&str]) -> Result<Tree, Fault> {
    let tokens = tokens(text)?;
    let mut reader = Reader { tokens, next: 0, names, depth: 0 };
    let tree = reader.chain(0)?;
    match reader.peek() {
        (Token::End, _) => Ok(tree),
        (Token::Sign(sign @ (")" | "]")), at) => {
            Err(Fault::new(*at, format!("`{sign}` closes where nothing is open")))
        }
        (Token::Sign(sign @ ("<" | "<=" | ">" | ">=")), at) => {
            Err(Fault::new(*at, format!("`{sign}` comes behind another order; join two with &&")))
        }
        (_, at) => {
            Err(Fault::new(*at, "something is missing between two values, such as && or =="))
        }
    }
}

fn tokens(text: &str) -> Result<Vec<(Token, usize)>, Fault> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        if first.is_whitespace() {
            at += first.len_utf8();
        } else if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if first.is_ascii_digit() {
            let (token, bytes) = number(rest).map_err(|what| Fault::new(at, what))?;
            found.push((token, at));
            at += bytes;
        } else if matches!(first, '"' | '\'' | '`') {
            let (text, bytes) =
                quoted(rest, first).map_err(|(more, what)| Fault::new(at + more, what))?;
            found.push((Token::Text(text), at));
            at += bytes;
        } else if first.is_ascii_alphabetic() || first == '_' {
            let word = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
            let bytes = rest.find(word).unwrap_or(rest.len());
            found.push((Token::Name(rest[..bytes].to_owned()), at));
            at += bytes;
        } else if first == ',' {
            found.push((Token::Sign(","), at));
            at += 1;
        } else if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
            found.push((Token::Sign(sign), at));
            at += sign.len();
        } else {
            return Err(Fault::new(
                at,
                match first {
                    '=' => {
                        "one = sets something, which no condition does; compare with ==".to_owned()
                    }
                    '&' => "one & is nothing here; write && for `and`".to_owned(),
                    '|' => "one | is nothing here; write || for `or`".to_owned(),
                    other => format!(
                        "`{other}` is nothing here; a condition compares names, numbers and \"words\""
                    ),
                },
            ));
        }
    }
    found.push((Token::End, text.len()));
    Ok(found)
}

/// A number and its bytes: `4`, `1_000`, `2.5`, `1e-3`.
fn number(text: &str) -> Result<(Token, usize), String> {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(|b| b.is_ascii_digit() || *b == b'_') {
            at += 1;
        }
        at
    };
    let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let mut end = digits(0);
    let mut whole = true;
    if bytes.get(end) == Some(&b'.') && is_digit(end + 1) {
        (end, whole) = (digits(end + 1), false);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if is_digit(end + 1 + sign) {
            (end, whole) = (digits(end + 1 + sign), false);
        }
    }
    if bytes.get(end).is_some_and(|b| b.is_ascii_alphanumeric()) {
        return Err("a number runs into a word; names begin with a letter".into());
    }
    let plain = text[..end].replace('_', "");
    let token = if whole {
        plain.parse().ok().map(Token::Whole)
    } else {
        plain.parse().ok().filter(|value: &f64| value.is_finite()).map(Token::Real)
    };
    Ok((token.ok_or_else(|| format!("{plain} is no number that fits 64 bits"))?, end))
}

/// A text between quotes and its bytes; `\"`, `\\`, `\n` and `\t` are known.
fn quoted(text: &str, quote: char) -> Result<(String, usize), (usize, String)> {
    let mut found = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            _ if c == quote => return Ok((found, at + c.len_utf8())),
            '\\' if quote != '`' => match characters.next() {
                Some((_, 'n')) => found.push('\n'),
                Some((_, 't')) => found.push('\t'),
                Some((_, c @ ('\\' | '"' | '\''))) => found.push(c),
                _ => return Err((at, "\\ stands before \", ', \\, n or t".into())),
            },
            _ => found.push(c),
        }
    }
    Err((0, format!("`{quote}` is missing at the end of a text")))
}

struct Reader<'a> {
    tokens: Vec<(Token, usize)>,
    next: usize,
    names: &'a [&'a str],
    depth: usize,
}

/// What binds looser comes first.
const LEVELS: [&[Between]; 7] = [
    &[Between::Or],
    &[Between::And],
    &[Between::Equal, Between::Unequal],
    &[Between::In],
    &[Between::Less, Between::LessOrEqual, Between::Greater, Between::GreaterOrEqual],
    &[Between::Plus, Between::Minus],
    &[Between::Times, Between::Over, Between::Remainder],
];
/// Level of what stands at most once in a chain: `in`, and orders.
const ONCE: [usize; 2] = [3, 4];

impl Reader<'_> {
    fn peek(&self) -> &(Token, usize) {
        &self.tokens[self.next]
    }

    fn take(&mut self) -> (Token, usize) {
        let token = self.tokens[self.next].clone();
        self.next = (self.next + 1).min(self.tokens.len() - 1);
        token
    }

    fn takes(&mut self, sign: &str) -> bool {
        let is = match &self.peek().0 {
            Token::Sign(found) => *found == sign,
            Token::Name(found) => found == sign,
            _ => false,
        };
        self.next += usize::from(is);
        is
    }

    /// Values of one level of binding, and what stands between them.
    fn chain(&mut self, level: usize) -> Result<Tree, Fault> {
        let Some(between) = LEVELS.get(level) else { return self.power() };
        let first = self.chain(level + 1)?;
        let at = first.at;
        let mut more = Vec::new();
        loop {
            let (_, place) = *self.peek();
            let Some(&sign) = between.iter().find(|between| self.takes(between.sign())) else {
                break;
            };
            let next =
                if sign == Between::In { self.listed(level + 1)? } else { self.chain(level + 1)? };
            more.push((sign, place, next));
            if ONCE.contains(&level) {
                break;
            }
        }
        if more.is_empty() {
            return Ok(first);
        }
        Ok(Tree { at, node: Node::Chain(Box::new(first), more) })
    }

    /// What stands behind `in`: a list, or a text.
    fn listed(&mut self, level: usize) -> Result<Tree, Fault> {
        let (_, at) = *self.peek();
        if !self.takes("[") {
            return self.chain(level);
        }
        let mut list = Vec::new();
        self.deeper(at)?;
        while !self.takes("]") {
            list.push(self.chain(0)?);
            if !self.takes(",") {
                self.close("]")?;
                break;
            }
        }
        self.depth -= 1;
        Ok(Tree { at, node: Node::List(list) })
    }

    fn close(&mut self, sign: &str) -> Result<(), Fault> {
        let (_, at) = *self.peek();
        if self.takes(sign) { Ok(()) } else { Err(Fault::new(at, format!("`{sign}` is missing"))) }
    }

    fn deeper(&mut self, at: usize) -> Result<(), Fault> {
        self.depth += 1;
        if self.depth > DEPTH_MAX { Err(too_deep(at)) } else { Ok(()) }
    }

    fn power(&mut self) -> Result<Tree, Fault> {
        let base = self.sign()?;
        let (_, place) = *self.peek();
        if !self.takes("**") {
            return Ok(base);
        }
        self.deeper(place)?;
        let power = self.power()?;
        self.depth -= 1;
        let at = base.at;
        Ok(Tree { at, node: Node::Chain(Box::new(base), vec![(Between::Power, place, power)]) })
    }

    fn sign(&mut self) -> Result<Tree, Fault> {
        let (_, at) = *self.peek();
        for (sign, make) in [("!", Node::Not as fn(Box<Tree>) -> Node), ("-", Node::Negative)] {
            if self.takes(sign) {
                self.deeper(at)?;
                let of = self.sign()?;
                self.depth -= 1;
                return Ok(Tree { at, node: make(Box::new(of)) });
            }
        }
        if self.takes("+") {
            self.deeper(at)?;
            let of = self.sign()?;
            self.depth -= 1;
            return Ok(of);
        }
        self.value()
    }

    fn value(&mut self) -> Result<Tree, Fault> {
        let (token, at) = self.take();
        let node = match token {
            Token::Whole(value) => Node::Whole(value),
            Token::Real(value) => Node::Real(value),
            Token::Text(text) => Node::Text(text),
            Token::Name(name) => match (&*name, self.names.iter().position(|known| *known == name))
            {
                (_, Some(column)) => Node::Column(column),
                ("true", None) => Node::Flag(true),
                ("false", None) => Node::Flag(false),
                _ => return Err(Fault::new(at, format!("`{name}` is no axis"))),
            },
            Token::Sign("(") => {
                self.deeper(at)?;
                let inside = self.chain(0)?;
                self.close(")")?;
                self.depth -= 1;
                return Ok(Tree { at, node: inside.node });
            }
            Token::Sign("[") => {
                // read on, so that what is nested without end is said to be
                self.deeper(at)?;
                if !matches!(self.peek().0, Token::Sign("]")) {
                    self.chain(0)?;
                }
                return Err(Fault::new(at, "a list stands behind `in`: rule in [\"ed\", \"bp\"]"));
            }
            Token::Sign(_) | Token::End => return Err(Fault::new(at, "a value is missing here")),
        };
        Ok(Tree { at, node })
    }
}

fn too_deep(at: usize) -> Fault {
    Fault::new(at, format!("nested too deep; {DEPTH_MAX} levels are allowed"))
}

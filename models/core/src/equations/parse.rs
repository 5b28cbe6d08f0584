//! From text to a syntax tree, by operator precedence (Pratt 1973).
//!
//! Precedence, loosest first: comparisons (which do not chain), `+ -`, `* /`, unary `-`, `^` (from the right).
//! Names are not resolved here. Next file to read: [`super::compile`].

mod call;

use super::expression_error::ExpressionError;
use super::node::{Function, Name, Node, Operation};

/// Parts nested deeper than this are refused, so that no expression can exhaust the stack.
const MAX_DEPTH: usize = 200;
/// Longest text, in characters.
const MAX_LENGTH: usize = 4000;

/// Every function of the language.
pub(super) const FUNCTIONS: [&str; 15] = [
    "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sign", "min", "max", "tanh", "step", "if", "delay",
    "ddt",
];

/// Parses a whole expression.
pub(super) fn parse(text: &str) -> Result<Node, ExpressionError> {
    let chars: Vec<char> = text.chars().collect();
    if chars.len() > MAX_LENGTH {
        return Err(ExpressionError::new(MAX_LENGTH + 1, format!("longer than {MAX_LENGTH} characters")));
    }
    let mut parser = Parser { chars, at: 0, depth: 0 };
    let node = parser.expression(0)?;
    match parser.peek() {
        None => Ok(node),
        Some(_) => Err(parser.unexpected("an operator or the end")),
    }
}

/// Column of the first `t` that stands for time.
pub(super) fn column_of_time(text: &str) -> Option<usize> {
    let chars: Vec<char> = text.chars().collect();
    let in_word =
        |i: Option<usize>| i.and_then(|i| chars.get(i)).is_some_and(|c| c.is_alphanumeric() || *c == '_');
    let alone = |i: &usize| chars[*i] == 't' && !in_word(i.checked_sub(1)) && !in_word(Some(i + 1));
    (0..chars.len()).find(alone).map(|i| i + 1)
}

struct Parser {
    chars: Vec<char>,
    at: usize,
    depth: usize,
}

/// Binding power of unary minus: above `*`, below `^`.
const UNARY: u8 = 7;

impl Parser {
    /// Next character that is not white space.
    fn peek(&mut self) -> Option<char> {
        while self.chars.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.chars.get(self.at).copied()
    }

    /// Takes `c` if it comes next.
    fn take(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        self.at += usize::from(found);
        found
    }

    fn column(&self) -> usize {
        self.at + 1
    }

    /// The word, number or character that comes next, quoted, for messages.
    fn found(&mut self) -> String {
        match self.peek() {
            None => "the end".to_owned(),
            Some(c) if c.is_alphanumeric() || c == '_' => {
                let word: String =
                    self.chars[self.at..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').collect();
                format!("`{word}`")
            }
            Some(c) => format!("`{c}`"),
        }
    }

    fn unexpected(&mut self, expected: &str) -> ExpressionError {
        let found = self.found();
        let hint = match self.peek() {
            Some(c) if expected.starts_with("an operator") && (c.is_alphabetic() || c == '(') => {
                " (a product needs `*`)"
            }
            Some('*') if self.at > 0 && self.chars[self.at - 1] == '*' => " (a power is written `^`)",
            Some('=') => " (equality is written `==`)",
            _ => "",
        };
        ExpressionError::new(self.column(), format!("expected {expected}, found {found}{hint}"))
    }

    /// The infix operator that comes next, its length and its left and right binding powers.
    fn infix(&mut self) -> Option<(Operation, usize, u8, u8)> {
        let c = self.peek()?;
        let equals = self.chars.get(self.at + 1) == Some(&'=');
        Some(match (c, equals) {
            ('<', true) => (Operation::LessEqual, 2, 1, 2),
            ('<', false) => (Operation::Less, 1, 1, 2),
            ('>', true) => (Operation::GreaterEqual, 2, 1, 2),
            ('>', false) => (Operation::Greater, 1, 1, 2),
            ('=', true) => (Operation::Equal, 2, 1, 2),
            ('!', true) => (Operation::NotEqual, 2, 1, 2),
            ('+', _) => (Operation::Add, 1, 3, 4),
            ('-', _) => (Operation::Sub, 1, 3, 4),
            ('*', _) => (Operation::Mul, 1, 5, 6),
            ('/', _) => (Operation::Div, 1, 5, 6),
            ('^', _) => (Operation::Pow, 1, 9, 8),
            _ => return None,
        })
    }

    /// An expression whose operators all bind at least as tightly as `floor`.
    fn expression(&mut self, floor: u8) -> Result<Node, ExpressionError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(ExpressionError::new(self.column(), format!("nested more than {MAX_DEPTH} deep")));
        }
        let mut left = self.prefix()?;
        let mut compared = false;
        while let Some((operation, length, l, r)) = self.infix() {
            if l < floor {
                break;
            }
            if operation.compares() && std::mem::replace(&mut compared, true) {
                let message = "comparisons do not chain: put one of them in parentheses";
                return Err(ExpressionError::new(self.column(), message));
            }
            self.at += length;
            let right = self.expression(r)?;
            left = Node::Pair(operation, Box::new(left), Box::new(right));
        }
        self.depth -= 1;
        Ok(left)
    }

    /// A number, a name, a call, a parenthesis, or one of these behind a sign.
    fn prefix(&mut self) -> Result<Node, ExpressionError> {
        match self.peek() {
            Some('-') => {
                self.at += 1;
                Ok(Node::Call(Function::Neg, Box::new(self.expression(UNARY)?)))
            }
            Some('+') => {
                self.at += 1;
                self.expression(UNARY)
            }
            Some('(') => {
                self.at += 1;
                let inside = self.expression(0)?;
                self.close("an operator or `)`")?;
                Ok(inside)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.word(),
            _ => Err(self.unexpected("a number, a name, a function or `(`")),
        }
    }

    fn close(&mut self, expected: &str) -> Result<(), ExpressionError> {
        if self.take(')') { Ok(()) } else { Err(self.unexpected(expected)) }
    }

    fn digits(&mut self) {
        while self.chars.get(self.at).is_some_and(char::is_ascii_digit) {
            self.at += 1;
        }
    }

    fn number(&mut self) -> Result<Node, ExpressionError> {
        let start = self.at;
        self.digits();
        if self.chars.get(self.at) == Some(&'.') {
            self.at += 1;
            self.digits();
        }
        if matches!(self.chars.get(self.at), Some('e' | 'E')) {
            let signed = usize::from(matches!(self.chars.get(self.at + 1), Some('+' | '-')));
            if self.chars.get(self.at + 1 + signed).is_some_and(char::is_ascii_digit) {
                self.at += 1 + signed;
                self.digits();
            }
        }
        let text: String = self.chars[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Node::Number(value)),
            Ok(_) => Err(ExpressionError::new(start + 1, format!("`{text}` is too large a number"))),
            Err(_) => Err(ExpressionError::new(start + 1, format!("expected a number, found `{text}`"))),
        }
    }

    fn identifier(&mut self) -> Name {
        let column = self.column();
        let text: String =
            self.chars[self.at..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').collect();
        self.at += text.chars().count();
        Name { text, column }
    }

    fn word(&mut self) -> Result<Node, ExpressionError> {
        let name = self.identifier();
        if self.take('(') {
            return self.call(&name);
        }
        match name.text.as_str() {
            "t" => Ok(Node::Time),
            "pi" => Ok(Node::Number(std::f64::consts::PI)),
            f if FUNCTIONS.contains(&f) => {
                Err(ExpressionError::new(name.column, format!("`{f}` is a function: expected `{f}(...)`")))
            }
            _ => Ok(Node::Name(name)),
        }
    }
}

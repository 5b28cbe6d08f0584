//! The syntax tree of an expression.
//!
//! It knows names, not where their values are: [`super::compile`] resolves them. Next file to read: [`super::parse`].

/// Functions of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Function {
    Neg,
    Sin,
    Cos,
    Tan,
    Exp,
    Log,
    Sqrt,
    Abs,
    Sign,
    Tanh,
    Step,
}

/// Operations on two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    Add,
    Sub,
    Mul,
    Div,
    Pow,
    Min,
    Max,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
}

impl Operation {
    /// Whether the result is a truth value, 1 or 0.
    pub(super) fn compares(self) -> bool {
        matches!(
            self,
            Self::Less | Self::LessEqual | Self::Greater | Self::GreaterEqual | Self::Equal | Self::NotEqual
        )
    }
}

/// A name and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Name {
    pub(super) text: String,
    /// Column of its first character, from 1.
    pub(super) column: usize,
}

/// The same name at two places is the same name.
impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

/// A part of an expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Node {
    Number(f64),
    Time,
    Name(Name),
    Call(Function, Box<Node>),
    Pair(Operation, Box<Node>, Box<Node>),
    If(Box<Node>, Box<Node>, Box<Node>),
    /// `delay(name, tau)`.
    Delay(Name, Box<Node>),
    /// Slope of the named input at `t - tau`; arises only by differentiation of `delay`.
    DelayedSlope(Name, Box<Node>),
    /// `ddt(name)`.
    Ddt(Name),
}

impl Node {
    /// The parts directly below.
    pub(super) fn children(&self) -> Vec<&Node> {
        match self {
            Self::Number(_) | Self::Time | Self::Name(_) | Self::Ddt(_) => vec![],
            Self::Call(_, a) | Self::Delay(_, a) | Self::DelayedSlope(_, a) => vec![a],
            Self::Pair(_, a, b) => vec![a, b],
            Self::If(c, a, b) => vec![c, a, b],
        }
    }

    /// Calls `visit` on this part and every part below, in the order of the text.
    pub(super) fn walk<'a>(&'a self, visit: &mut dyn FnMut(&'a Node)) {
        visit(self);
        for child in self.children() {
            child.walk(visit);
        }
    }

    /// The name that stands here, be it plain or under `delay` or `ddt`.
    pub(super) fn name(&self) -> Option<&Name> {
        match self {
            Self::Name(n) | Self::Delay(n, _) | Self::DelayedSlope(n, _) | Self::Ddt(n) => Some(n),
            _ => None,
        }
    }

    /// Number of parts.
    pub(super) fn size(&self) -> usize {
        let mut count = 0;
        self.walk(&mut |_| count += 1);
        count
    }

    /// Number of parts on the longest way down.
    pub(super) fn depth(&self) -> usize {
        1 + self.children().into_iter().map(Node::depth).max().unwrap_or(0)
    }
}

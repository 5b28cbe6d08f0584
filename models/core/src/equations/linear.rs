//! Splits an expression that is linear in chosen names into their factors and the rest, exactly.
//!
//! Nothing is expanded that does not have to be: (a + b) p has the factor a + b. A sum below a product, a quotient or an `if` goes
//! through; a chosen name inside a function, a power, a condition or beside another one is refused. Next file to read: [`super::drift`].

use super::calculus::{add, call, div, mul, sub};
use super::expression_error::ExpressionError;
use super::node::{Function, Node, Operation};

/// An expression as rest + Σ name · factor.
pub(super) struct Linear {
    /// What stands without any of the names; `None` is zero.
    pub(super) rest: Option<Node>,
    /// The factor of every name, in their order; `None` is zero.
    pub(super) factors: Vec<Option<Node>>,
}

/// Splits a tree.
///
/// # Errors
/// At the column of a name in which the expression is not linear.
pub(super) fn split(node: &Node, names: &[String]) -> Result<Linear, ExpressionError> {
    let Some(first) = chosen(node, names) else {
        return Ok(Linear { rest: Some(node.clone()), factors: vec![None; names.len()] });
    };
    let refuse = |part: &Node| {
        let (name, column) = chosen(part, names).unwrap_or_else(|| first.clone());
        Err(ExpressionError::new(column, format!("the rate is not linear in `{name}`")))
    };
    match node {
        Node::Name(name) => {
            let factor = |known: &String| (*known == name.text).then_some(Node::Number(1.0));
            Ok(Linear { rest: None, factors: names.iter().map(factor).collect() })
        }
        Node::Call(Function::Neg, a) => Ok(split(a, names)?.map(|part| call(Function::Neg, part))),
        Node::Pair(Operation::Add, a, b) => Ok(split(a, names)?.with(split(b, names)?, add)),
        Node::Pair(Operation::Sub, a, b) => {
            let negative = |part: Node| call(Function::Neg, part);
            let (left, right) = (split(a, names)?, split(b, names)?);
            Ok(left.zip(right, |a, b| match (a, b) {
                (Some(a), Some(b)) => Some(sub(a, b)),
                (a, b) => a.or_else(|| b.map(negative)),
            }))
        }
        Node::Pair(Operation::Mul, a, b) if chosen(a, names).is_none() => {
            Ok(split(b, names)?.map(|part| mul((**a).clone(), part)))
        }
        Node::Pair(Operation::Mul, a, b) if chosen(b, names).is_none() => {
            Ok(split(a, names)?.map(|part| mul(part, (**b).clone())))
        }
        Node::Pair(Operation::Div, a, b) if chosen(b, names).is_none() => {
            Ok(split(a, names)?.map(|part| div(part, (**b).clone())))
        }
        Node::If(condition, a, b) if chosen(condition, names).is_none() => {
            let zero = || Node::Number(0.0);
            let choose = |a: Option<Node>, b: Option<Node>| {
                if a.is_none() && b.is_none() {
                    return None;
                }
                let (a, b) = (a.unwrap_or_else(zero), b.unwrap_or_else(zero));
                Some(Node::If(condition.clone(), Box::new(a), Box::new(b)))
            };
            Ok(split(a, names)?.zip(split(b, names)?, choose))
        }
        Node::Pair(Operation::Div, _, b) if chosen(b, names).is_some() => refuse(b),
        other => refuse(other),
    }
}

impl Linear {
    fn map(self, change: impl Fn(Node) -> Node) -> Self {
        let Self { rest, factors } = self;
        Self { rest: rest.map(&change), factors: factors.into_iter().map(|f| f.map(&change)).collect() }
    }

    fn zip(self, other: Self, join: impl Fn(Option<Node>, Option<Node>) -> Option<Node>) -> Self {
        let factors = self.factors.into_iter().zip(other.factors).map(|(a, b)| join(a, b)).collect();
        Self { rest: join(self.rest, other.rest), factors }
    }

    fn with(self, other: Self, join: impl Fn(Node, Node) -> Node) -> Self {
        self.zip(other, |a, b| match (a, b) {
            (Some(a), Some(b)) => Some(join(a, b)),
            (a, b) => a.or(b),
        })
    }
}

/// The first of the names in a tree, with its column.
fn chosen(node: &Node, names: &[String]) -> Option<(String, usize)> {
    let mut found = None;
    node.walk(&mut |part| {
        if let Some(name) = part.name().filter(|name| found.is_none() && names.contains(&name.text)) {
            found = Some((name.text.clone(), name.column));
        }
    });
    found
}

/// A tree as a number times a tree without a number before it.
pub(super) fn factored(node: &Node) -> (f64, Node) {
    match node {
        Node::Number(value) => (*value, Node::Number(1.0)),
        Node::Call(Function::Neg, a) => {
            let (factor, rest) = factored(a);
            (-factor, rest)
        }
        Node::Pair(Operation::Mul, a, b) => {
            let ((left, a), (right, b)) = (factored(a), factored(b));
            (left * right, mul(a, b))
        }
        Node::Pair(Operation::Div, a, b) => {
            let (factor, a) = factored(a);
            match **b {
                Node::Number(by) => (factor / by, a),
                _ => (factor, div(a, (**b).clone())),
            }
        }
        other => (1.0, other.clone()),
    }
}

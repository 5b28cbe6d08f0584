//! An expression of the study language: parsed once, compiled against a model's names, evaluated many times.
//!
//! It does not know models: whoever compiles it says where each name's value is. Next file to read: [`super::def`].

use super::at::Slot;
use super::expression_error::ExpressionError;
use super::node::{Function, Node, Operation};
use super::{calculus, compile, linear, parse};

use super::program::Program;

/// A parsed expression and its text.
///
/// `+ - * / ^` with `-x^2 = -(x^2)` and `2^3^2 = 512`; comparisons, giving 1 or 0; `if(cond, a, b)`; `sin cos tan exp log
/// sqrt abs sign min max tanh step`; `pi`, `t`; `delay(u, tau)` and `ddt(u)`. A negative `tau` reads ahead in an input;
/// of a state or output `tau` needs a bound, as in `delay(y, min(tau, 0.5))`.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    text: String,
    node: Node,
}

impl Expression {
    /// Parses an expression.
    ///
    /// # Errors
    /// With the column of the first fault and what was expected there.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        Ok(Self { text: text.to_owned(), node: parse::parse(text)? })
    }

    /// The expression's text; a derived expression keeps the text that it came from.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The free identifiers, each with the column of its first use, in the order of the text; not `t`, `pi` or functions.
    pub fn names(&self) -> Vec<(String, usize)> {
        let mut list: Vec<(String, usize)> = Vec::new();
        self.node.walk(&mut |part| {
            if let Some(name) = part.name()
                && !list.iter().any(|(n, _)| *n == name.text)
            {
                list.push((name.text.clone(), name.column));
            }
        });
        list
    }

    /// Whether `t` stands in it.
    pub fn uses_time(&self) -> bool {
        let mut found = false;
        self.node.walk(&mut |part| found |= matches!(part, Node::Time));
        found
    }

    /// Whether the slope or the past of a name stands in it.
    pub fn has_memory(&self) -> bool {
        let mut found = false;
        self.node.walk(&mut |part| {
            found |= matches!(part, Node::Delay(..) | Node::DelayedSlope(..) | Node::Ddt(_));
        });
        found
    }

    /// Whether it is a sum of terms in each of which the name stands as a factor once or not at all.
    pub fn is_linear_in(&self, name: &str) -> bool {
        linear::split(&self.node, &[name.to_owned()]).is_ok()
    }

    /// Whether the names that `moves` chooses, and the time, enter as powers in a product only: in no sum, no function and no condition.
    pub fn is_product_in(&self, moves: &dyn Fn(&str) -> bool) -> bool {
        fn varies(part: &Node, moves: &dyn Fn(&str) -> bool) -> bool {
            let mut found = false;
            part.walk(&mut |n| {
                found |= matches!(n, Node::Time) || n.name().is_some_and(|name| moves(&name.text));
            });
            found
        }
        fn is_product(part: &Node, moves: &dyn Fn(&str) -> bool) -> bool {
            match part {
                Node::Number(_) | Node::Time | Node::Name(_) => true,
                Node::Call(Function::Neg, a) => is_product(a, moves),
                Node::Pair(Operation::Mul | Operation::Div, a, b) => {
                    is_product(a, moves) && is_product(b, moves)
                }
                Node::Pair(Operation::Pow, a, power) if !varies(power, moves) => is_product(a, moves),
                _ => !varies(part, moves),
            }
        }
        is_product(&self.node, moves)
    }

    /// Makes flat code out of the expression.
    ///
    /// `resolve` says where a name's value is, `nearest` offers a valid name for an unknown one. `ddt` of a name that is not
    /// an input asks `resolve` for `ddt:<name>`, and `delay` of one for `delay:<name>`, so that a model which keeps those
    /// values can offer them: the past as an input of [`super::At::u`]'s history, behind those that have a value.
    ///
    /// # Errors
    /// At the column of an unknown name, of a `ddt` or `delay` without value, and for expressions that nest too deep.
    pub fn compile(
        &self,
        resolve: &dyn Fn(&str) -> Option<Slot>,
        nearest: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Program, ExpressionError> {
        compile::compile(&self.node, resolve, nearest)
    }

    /// The switching functions: expressions at whose sign changes this expression jumps or has a kink.
    ///
    /// These are the arguments of `sign`, `step` and `abs`, the difference of the arguments of `min` and `max`, and the
    /// difference of the two sides of a comparison.
    pub fn discontinuities(&self) -> Vec<Expression> {
        let mut list: Vec<Expression> = Vec::new();
        self.node.walk(&mut |part| {
            if let Some(node) = switching(part)
                && !list.iter().any(|e| e.node == node)
            {
                list.push(self.derived(node));
            }
        });
        list
    }

    /// Whether the value may jump where something moves: where a sign, a step, a comparison, a condition or the
    /// time at which the slope of an input is read looks at one of the names.
    pub(super) fn jumps(&self, moves: &dyn Fn(&str) -> bool) -> bool {
        let mut found = false;
        self.node.walk(&mut |part| {
            let has_kink_only = matches!(
                part,
                Node::Call(Function::Abs, _) | Node::Pair(Operation::Min | Operation::Max, ..)
            );
            let decides = match part {
                // The slope of an input jumps at its samples.
                Node::DelayedSlope(_, tau) => Some((**tau).clone()),
                _ => switching(part).filter(|_| !has_kink_only),
            };
            if let Some(g) = decides {
                g.walk(&mut |n| found |= n.name().is_some_and(|name| moves(&name.text)));
            }
        });
        found
    }

    pub(super) fn node(&self) -> &Node {
        &self.node
    }

    pub(super) fn new(text: String, node: Node) -> Self {
        Self { text, node }
    }

    /// An expression made from this one, with its text.
    pub(super) fn derived(&self, node: Node) -> Self {
        Self { text: self.text.clone(), node }
    }
}

/// The switching function of this part alone, unless it never changes.
fn switching(part: &Node) -> Option<Node> {
    use Function::{Abs, Sign, Step};
    let g = match part {
        Node::Call(Sign | Step | Abs, a) => (**a).clone(),
        Node::Pair(operation, a, b)
            if operation.compares() || matches!(operation, Operation::Min | Operation::Max) =>
        {
            calculus::sub((**a).clone(), (**b).clone())
        }
        Node::If(condition, ..) if !matches!(**condition, Node::Pair(o, ..) if o.compares()) => {
            (**condition).clone()
        }
        _ => return None,
    };
    let varies = {
        let mut found = false;
        g.walk(&mut |n| {
            found |= !matches!(n, Node::Number(_) | Node::Call(..) | Node::Pair(..) | Node::If(..));
        });
        found
    };
    varies.then_some(g)
}

//! Rewrites an expression until only states, inputs, parameters and `t` are left.
//!
//! Outputs are replaced by their values; `ddt` of a state by its rate, of an output by its total derivative. What would need
//! itself is refused. Next file to read: [`super::build`].

use std::cell::RefCell;

use super::calculus;
use super::expression_error::ExpressionError;
use super::node::{Name, Node};

/// Largest expression after rewriting.
const MAX_SIZE: usize = 20_000;
/// Deepest one, so that no chain of outputs can exhaust the stack.
const MAX_DEPTH: usize = 2500;

/// The names of a model and what they stand for.
pub(super) struct Names<'a> {
    /// States with their rates.
    pub(super) states: Vec<(&'a str, Node)>,
    /// Outputs with their values; an output named as a state is that state.
    pub(super) outputs: Vec<(&'a str, Node)>,
    /// Inputs.
    pub(super) inputs: Vec<&'a str>,
    /// What is being rewritten, to find circles.
    pub(super) open: RefCell<Vec<String>>,
}

impl Names<'_> {
    pub(super) fn state(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|(n, _)| *n == name)
    }

    pub(super) fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|n| *n == name)
    }

    /// Whether the name stands for a state, an input or an output.
    pub(super) fn is_taken(&self, name: &str) -> bool {
        self.state(name).is_some() || self.input(name).is_some() || self.output(name).is_some()
    }

    /// The value of an output that is not simply a state.
    fn output(&self, name: &str) -> Option<&Node> {
        if self.state(name).is_some() {
            return None;
        }
        self.outputs.iter().find(|(n, _)| *n == name).map(|(_, value)| value)
    }

    /// Rewrites a tree.
    pub(super) fn inline(&self, node: &Node) -> Result<Node, ExpressionError> {
        let done = self.rewrite(node)?;
        let (size, depth) = (done.size(), done.depth());
        if size > MAX_SIZE || depth > MAX_DEPTH {
            let message = format!(
                "{size} operations, nested {depth} deep, once outputs are put in, where {MAX_SIZE} and {MAX_DEPTH} are \
                 allowed: use states for some of them"
            );
            return Err(ExpressionError::new(1, message));
        }
        Ok(done)
    }

    fn rewrite(&self, node: &Node) -> Result<Node, ExpressionError> {
        let below = |part: &Node| self.rewrite(part).map(Box::new);
        Ok(match node {
            Node::Number(_) | Node::Time => node.clone(),
            Node::Call(function, a) => Node::Call(*function, below(a)?),
            Node::Pair(operation, a, b) => Node::Pair(*operation, below(a)?, below(b)?),
            Node::If(c, a, b) => Node::If(below(c)?, below(a)?, below(b)?),
            Node::Name(name) => match self.output(&name.text) {
                Some(value) => self.within(name, &name.text, || self.inline(value))?,
                None => node.clone(),
            },
            Node::Ddt(name) => self.total_derivative(name)?,
            Node::DelayedSlope(name, tau) => Node::DelayedSlope(name.clone(), below(tau)?),
            Node::Delay(name, tau) => {
                let tau = below(tau)?;
                match self.output(&name.text) {
                    Some(value) => {
                        let value = self.within(name, &name.text, || self.inline(value))?;
                        self.earlier(&value, &tau).unwrap_or_else(|| Node::Delay(name.clone(), tau))
                    }
                    None => Node::Delay(name.clone(), tau),
                }
            }
        })
    }

    fn total_derivative(&self, name: &Name) -> Result<Node, ExpressionError> {
        let key = format!("ddt({})", name.text);
        if let Some(state) = self.state(&name.text) {
            return self.within(name, &key, || self.inline(&self.states[state].1));
        }
        let Some(value) = self.output(&name.text) else { return Ok(Node::Ddt(name.clone())) };
        self.within(name, &key, || {
            let value = self.inline(value)?;
            let derivative = calculus::ddt(&value, &mut |part| {
                if self.state(&part.text).is_some() {
                    self.total_derivative(&Name { column: name.column, ..part.clone() })
                } else if self.input(&part.text).is_some() {
                    Ok(Node::Ddt(part.clone()))
                } else {
                    Ok(Node::Number(0.0))
                }
            })?;
            self.inline(&derivative)
        })
    }

    /// Runs `work` unless `key` is already being worked on; faults inside are shown at the name that led there.
    fn within(
        &self,
        name: &Name,
        key: &str,
        work: impl FnOnce() -> Result<Node, ExpressionError>,
    ) -> Result<Node, ExpressionError> {
        if self.open.borrow().iter().any(|k| k == key) {
            return Err(ExpressionError::new(name.column, format!("`{key}` would depend on itself")));
        }
        self.open.borrow_mut().push(key.to_owned());
        let done = work().map_err(|e| ExpressionError { column: name.column, ..e });
        self.open.borrow_mut().pop();
        done
    }

    /// The value of a tree without states, a time `tau` earlier.
    fn earlier(&self, node: &Node, tau: &Node) -> Option<Node> {
        let below = |part: &Node| self.earlier(part, tau).map(Box::new);
        let later = |inner: &Node| Some(Box::new(calculus::add(self.earlier(inner, tau)?, tau.clone())));
        Some(match node {
            Node::Time => calculus::sub(Node::Time, tau.clone()),
            Node::Name(name) if self.state(&name.text).is_some() => return None,
            Node::Name(name) if self.input(&name.text).is_some() => {
                Node::Delay(name.clone(), Box::new(tau.clone()))
            }
            Node::Number(_) | Node::Name(_) => node.clone(),
            Node::Call(function, a) => Node::Call(*function, below(a)?),
            Node::Pair(operation, a, b) => Node::Pair(*operation, below(a)?, below(b)?),
            Node::If(c, a, b) => Node::If(below(c)?, below(a)?, below(b)?),
            Node::Delay(name, inner) if self.input(&name.text).is_some() => {
                Node::Delay(name.clone(), later(inner)?)
            }
            Node::DelayedSlope(name, inner) => Node::DelayedSlope(name.clone(), later(inner)?),
            Node::Ddt(name) => Node::DelayedSlope(name.clone(), Box::new(tau.clone())),
            Node::Delay(..) => return None,
        })
    }
}

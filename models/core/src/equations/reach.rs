//! How far back a `delay` reads, as far as the text tells: interval arithmetic (Moore 1966) over its second argument.
//!
//! Next file to read: [`crate::memory`].

use super::expression::Expression;
use super::expression_error::ExpressionError;
use super::node::{Function, Name, Node, Operation};

/// Where nothing is known.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

impl Expression {
    /// Every delayed name for which `kept` holds, with its longest delay, given the range of each name.
    ///
    /// # Errors
    /// At a delay without a finite upper bound above zero.
    pub(crate) fn delays(
        &self,
        kept: &dyn Fn(&str) -> bool,
        range: &dyn Fn(&str) -> [f64; 2],
    ) -> Result<Vec<(String, f64)>, ExpressionError> {
        let mut list = Vec::new();
        let mut fault = None;
        self.node().walk(&mut |part| {
            if let Node::Delay(name, tau) | Node::DelayedSlope(name, tau) = part
                && kept(&name.text)
            {
                match longest(name, tau, range) {
                    Ok(longest) => list.push((name.text.clone(), longest)),
                    Err(error) => fault = fault.take().or(Some(error)),
                }
            }
        });
        fault.map_or(Ok(list), Err)
    }
}

/// The largest value of `tau`.
fn longest(name: &Name, tau: &Node, range: &dyn Fn(&str) -> [f64; 2]) -> Result<f64, ExpressionError> {
    let [_, hi] = interval(tau, range);
    let message = if hi.is_finite() && hi > 0.0 {
        return Ok(hi);
    } else if hi <= 0.0 {
        format!("the delay of `{}` is never above zero: write `{0}` itself", name.text)
    } else {
        format!(
            "how far back `{}` is read has no bound: write the delay as `min(tau, 0.5)`, with the longest delay in \
             place of 0.5, make it a constant, or give the effect's parameter a finite range",
            name.text
        )
    };
    Err(ExpressionError::new(name.column, message))
}

/// An interval that holds the value of a tree.
fn interval(node: &Node, range: &dyn Fn(&str) -> [f64; 2]) -> [f64; 2] {
    match node {
        Node::Number(n) => [*n, *n],
        Node::Name(name) => range(&name.text),
        Node::Call(function, a) => call(*function, interval(a, range)),
        Node::Pair(operation, a, b) => pair(*operation, interval(a, range), interval(b, range)),
        Node::If(_, a, b) => hull(interval(a, range), interval(b, range)),
        Node::Time | Node::Delay(..) | Node::DelayedSlope(..) | Node::Ddt(_) => ANY,
    }
}

fn hull(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

fn call(function: Function, [lo, hi]: [f64; 2]) -> [f64; 2] {
    match function {
        Function::Neg => [-hi, -lo],
        Function::Abs => [if lo <= 0.0 && hi >= 0.0 { 0.0 } else { lo.abs().min(hi.abs()) }, hi.max(-lo)],
        Function::Exp => [lo.exp(), hi.exp()],
        Function::Sin | Function::Cos | Function::Tanh | Function::Sign => [-1.0, 1.0],
        Function::Step => [0.0, 1.0],
        Function::Tan | Function::Log | Function::Sqrt => ANY,
    }
}

fn pair(operation: Operation, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    match operation {
        Operation::Add => [a[0] + b[0], a[1] + b[1]],
        Operation::Sub => [a[0] - b[1], a[1] - b[0]],
        Operation::Mul => corners(a, b, |x, y| x * y),
        Operation::Div if b[0] > 0.0 || b[1] < 0.0 => corners(a, b, |x, y| x / y),
        Operation::Min => [a[0].min(b[0]), a[1].min(b[1])],
        Operation::Max => [a[0].max(b[0]), a[1].max(b[1])],
        Operation::Div | Operation::Pow => ANY,
        _ => [0.0, 1.0],
    }
}

/// The hull of an operation on the ends; nothing is known where an end is no number.
fn corners(a: [f64; 2], b: [f64; 2], operation: fn(f64, f64) -> f64) -> [f64; 2] {
    let values = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| operation(a[i], b[j]));
    if values.iter().any(|v| v.is_nan()) {
        return ANY;
    }
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |all, v| hull(all, [*v, *v]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn longest_of(text: &str) -> Result<f64, String> {
        let range = |name: &str| if name == "r" { [0.1, 0.4] } else { ANY };
        let delays = Expression::parse(text).expect(text).delays(&|name| name == "y", &range);
        delays.map(|list| list.iter().map(|(_, d)| *d).fold(0.0, f64::max)).map_err(|e| e.to_string())
    }

    #[test]
    fn a_bound_follows_from_numbers_ranges_and_minima() {
        let table = [
            ("delay(y, 0.5)", 0.5),
            ("delay(y, r)", 0.4),
            ("delay(y, 2*r + 1)", 1.8),
            ("delay(y, 1/r)", 10.0),
            ("delay(y, min(tau, 0.7))", 0.7),
            ("delay(y, if(tau > 1, 0.2, r - 1))", 0.2),
            ("delay(y, 1 - abs(tau))", 1.0),
            ("delay(y, 0.1) + delay(y, 0.3) + delay(u, 9)", 0.3),
        ];
        for (text, want) in table {
            // One rounding per operation.
            assert!((longest_of(text).expect(text) - want).abs() < 1e-14, "{text}");
        }
    }

    #[test]
    fn a_delay_without_bound_or_below_zero_is_refused() {
        for text in ["delay(y, tau)", "delay(y, r/tau)", "delay(y, 1/0)", "delay(y, max(tau, 1))"] {
            assert!(longest_of(text).expect_err(text).contains("min(tau, 0.5)"), "{text}");
        }
        for text in ["delay(y, 0)", "delay(y, -r)"] {
            assert!(longest_of(text).expect_err(text).contains("never above zero"), "{text}");
        }
    }
}

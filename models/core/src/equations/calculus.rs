//! Sums and products of syntax trees that drop zeros and ones, and the total time derivative.
//!
//! Used to write `ddt` of an output as an ordinary expression; derivatives at run time are [`super::program`]'s forward mode.
//! Next file to read: [`super::inline`].

use super::node::{Function, Name, Node, Operation};

fn is(node: &Node, value: f64) -> bool {
    matches!(node, Node::Number(n) if n.to_bits() == value.to_bits())
}

fn pair(operation: Operation, a: Node, b: Node) -> Node {
    Node::Pair(operation, Box::new(a), Box::new(b))
}

pub(super) fn call(function: Function, a: Node) -> Node {
    Node::Call(function, Box::new(a))
}

pub(super) fn add(a: Node, b: Node) -> Node {
    if is(&a, 0.0) {
        b
    } else if is(&b, 0.0) {
        a
    } else {
        pair(Operation::Add, a, b)
    }
}

pub(super) fn sub(a: Node, b: Node) -> Node {
    if is(&b, 0.0) {
        a
    } else if is(&a, 0.0) {
        call(Function::Neg, b)
    } else {
        pair(Operation::Sub, a, b)
    }
}

pub(super) fn mul(a: Node, b: Node) -> Node {
    if is(&a, 0.0) || is(&b, 0.0) {
        Node::Number(0.0)
    } else if is(&a, 1.0) {
        b
    } else if is(&b, 1.0) {
        a
    } else {
        pair(Operation::Mul, a, b)
    }
}

pub(super) fn div(a: Node, b: Node) -> Node {
    if is(&a, 0.0) { a } else { pair(Operation::Div, a, b) }
}

/// The total derivative of `node` with respect to time, given that of each name.
pub(super) fn ddt<E>(node: &Node, of: &mut dyn FnMut(&Name) -> Result<Node, E>) -> Result<Node, E> {
    Ok(match node {
        Node::Time => Node::Number(1.0),
        Node::Name(name) => of(name)?,
        Node::Call(function, a) => mul(slope(*function, a), ddt(a, of)?),
        Node::Pair(operation, a, b) => {
            let (da, db) = (ddt(a, of)?, ddt(b, of)?);
            pair_ddt(*operation, a, b, da, db)
        }
        Node::If(c, a, b) => choose((**c).clone(), ddt(a, of)?, ddt(b, of)?),
        Node::Delay(name, tau) => {
            let passing = sub(Node::Number(1.0), ddt(tau, of)?);
            mul(Node::DelayedSlope(name.clone(), tau.clone()), passing)
        }
        // Inputs are linear between samples.
        Node::Number(_) | Node::DelayedSlope(..) | Node::Ddt(_) => Node::Number(0.0),
    })
}

fn choose(condition: Node, a: Node, b: Node) -> Node {
    if a == b { a } else { Node::If(Box::new(condition), Box::new(a), Box::new(b)) }
}

/// The derivative of a function at `a`.
fn slope(function: Function, a: &Node) -> Node {
    let again = || call(function, a.clone());
    let one = || Node::Number(1.0);
    match function {
        Function::Neg => Node::Number(-1.0),
        Function::Sin => call(Function::Cos, a.clone()),
        Function::Cos => call(Function::Neg, call(Function::Sin, a.clone())),
        Function::Tan => add(one(), mul(again(), again())),
        Function::Exp => again(),
        Function::Log => div(one(), a.clone()),
        Function::Sqrt => div(Node::Number(0.5), again()),
        Function::Abs => call(Function::Sign, a.clone()),
        Function::Sign | Function::Step => Node::Number(0.0),
        Function::Tanh => sub(one(), mul(again(), again())),
    }
}

/// The derivative of an operation, given those of its two sides.
fn pair_ddt(operation: Operation, a: &Node, b: &Node, da: Node, db: Node) -> Node {
    let (a, b) = (a.clone(), b.clone());
    match operation {
        Operation::Add => add(da, db),
        Operation::Sub => sub(da, db),
        Operation::Mul => add(mul(da, b), mul(a, db)),
        Operation::Div => sub(div(da, b.clone()), div(mul(a, db), mul(b.clone(), b))),
        Operation::Pow => {
            let less = match &b {
                Node::Number(n) => Node::Number(n - 1.0),
                _ => sub(b.clone(), Node::Number(1.0)),
            };
            let base = mul(mul(b.clone(), pair(Operation::Pow, a.clone(), less)), da);
            let power = pair(Operation::Pow, a.clone(), b);
            add(base, mul(mul(power, call(Function::Log, a)), db))
        }
        Operation::Min => choose(pair(Operation::LessEqual, a, b), da, db),
        Operation::Max => choose(pair(Operation::GreaterEqual, a, b), da, db),
        _ => Node::Number(0.0),
    }
}

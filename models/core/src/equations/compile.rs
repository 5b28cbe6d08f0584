//! From a syntax tree to flat code: names become slots, constants are folded, whole powers become products.
//!
//! Next file to read: [`super::tape`], the code.

use super::at::Slot;
use super::expression_error::ExpressionError;
use super::node::{Name, Node, Operation};
use super::program::Program;
use super::tape::{Operand, Writer};
use super::values::{self, Source};
use crate::meant;

/// Deepest expression: so many values may wait for others at a time.
const MAX_WAITING: usize = 64;

/// Largest whole exponent that is worked out by multiplication.
const MAX_POWER: f64 = 64.0;

type Resolve<'a> = &'a dyn Fn(&str) -> Option<Slot>;
type Nearest<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Compiles a tree.
pub(super) fn compile(
    node: &Node,
    resolve: Resolve<'_>,
    nearest: Nearest<'_>,
) -> Result<Program, ExpressionError> {
    let tree = Compiler { resolve, nearest }.resolved(node)?;
    if tree.waiting() > MAX_WAITING {
        return Err(ExpressionError::new(1, "nested too deep: split it into several outputs or states"));
    }
    let mut writer = Writer::default();
    let value = tree.written(&mut writer);
    Ok(Program { tape: writer.finish(&[value]), n_operation: tree.n_operation() })
}

/// A tree whose names are resolved and whose constants are folded.
enum Tree {
    Leaf(Source),
    Call(super::node::Function, Box<Tree>),
    Pair(Operation, Box<Tree>, Box<Tree>),
    Power(Box<Tree>, i32),
    If(Box<Tree>, Box<Tree>, Box<Tree>),
    Delay(u32, Box<Tree>),
    DelayedSlope(u32, Box<Tree>),
}

struct Compiler<'a> {
    resolve: Resolve<'a>,
    nearest: Nearest<'a>,
}

fn number(tree: &Tree) -> Option<f64> {
    if let Tree::Leaf(Source::Number(n)) = tree { Some(*n) } else { None }
}

fn constant(value: f64) -> Tree {
    Tree::Leaf(Source::Number(value))
}

fn source(slot: Slot) -> Source {
    match slot {
        Slot::State(i) => Source::State(i as u32),
        Slot::Parameter(i) => Source::Parameter(i as u32),
        Slot::Input(i) => Source::Input(i as u32),
        Slot::Output(i) => Source::Output(i as u32),
        Slot::Constant(c) => Source::Number(c),
    }
}

impl Compiler<'_> {
    fn slot(&self, name: &Name) -> Result<Slot, ExpressionError> {
        (self.resolve)(&name.text).ok_or_else(|| {
            let hint = meant((self.nearest)(&name.text));
            ExpressionError::new(name.column, format!("unknown name `{}`{hint}", name.text))
        })
    }

    fn resolved(&self, node: &Node) -> Result<Tree, ExpressionError> {
        Ok(match node {
            Node::Number(n) => constant(*n),
            Node::Time => Tree::Leaf(Source::Time),
            Node::Name(name) => Tree::Leaf(source(self.slot(name)?)),
            Node::Call(function, a) => {
                let a = self.resolved(a)?;
                match number(&a) {
                    Some(value) => constant(values::call(*function, value)),
                    None => Tree::Call(*function, Box::new(a)),
                }
            }
            Node::Pair(operation, a, b) => fold(*operation, self.resolved(a)?, self.resolved(b)?),
            Node::If(c, a, b) => {
                let (c, a, b) = (self.resolved(c)?, self.resolved(a)?, self.resolved(b)?);
                match number(&c) {
                    Some(value) if value.abs() > 0.0 => a,
                    Some(_) => b,
                    None => Tree::If(Box::new(c), Box::new(a), Box::new(b)),
                }
            }
            Node::Ddt(name) => self.ddt(name)?,
            Node::Delay(name, tau) => self.delay(name, tau, Tree::Delay)?,
            Node::DelayedSlope(name, tau) => self.delay(name, tau, Tree::DelayedSlope)?,
        })
    }

    fn ddt(&self, name: &Name) -> Result<Tree, ExpressionError> {
        match self.slot(name)? {
            Slot::Input(i) => Ok(Tree::Leaf(Source::Slope(i as u32))),
            Slot::Constant(_) | Slot::Parameter(_) => {
                let message = format!("`{}` is constant: `ddt` needs an input or an output", name.text);
                Err(ExpressionError::new(name.column, message))
            }
            _ => (self.resolve)(&format!("ddt:{}", name.text))
                .map(|slot| Tree::Leaf(source(slot)))
                .ok_or_else(|| {
                    let message = format!("the time derivative of `{}` is not known here", name.text);
                    ExpressionError::new(name.column, message)
                }),
        }
    }

    fn delay(
        &self,
        name: &Name,
        tau: &Node,
        make: fn(u32, Box<Tree>) -> Tree,
    ) -> Result<Tree, ExpressionError> {
        match self.slot(name)? {
            Slot::Input(i) => Ok(make(i as u32, Box::new(self.resolved(tau)?))),
            Slot::Constant(_) | Slot::Parameter(_) => {
                let message = format!("`{}` is constant: `delay` needs an input or an output", name.text);
                Err(ExpressionError::new(name.column, message))
            }
            _ => {
                if let Some(Slot::Input(i)) = (self.resolve)(&format!("delay:{}", name.text)) {
                    return Ok(make(i as u32, Box::new(self.resolved(tau)?)));
                }
                let message = format!("the past of `{}` is not known here", name.text);
                Err(ExpressionError::new(name.column, message))
            }
        }
    }
}

impl Tree {
    /// Values that wait for others at most while this one is worked out from left to right.
    fn waiting(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Call(_, a) | Self::Power(a, _) | Self::Delay(_, a) | Self::DelayedSlope(_, a) => {
                a.waiting()
            }
            Self::Pair(_, a, b) if matches!(**b, Self::Leaf(_)) => a.waiting(),
            Self::Pair(_, a, b) => a.waiting().max(1 + b.waiting()),
            Self::If(c, a, b) => c.waiting().max(a.waiting()).max(b.waiting()),
        }
    }

    /// Operations as they are written: a value is read in one, except as the second of two.
    fn n_operation(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Call(_, a) | Self::Power(a, _) | Self::Delay(_, a) | Self::DelayedSlope(_, a) => {
                1 + a.n_operation()
            }
            Self::Pair(_, a, b) if matches!(**b, Self::Leaf(_)) => 1 + a.n_operation(),
            Self::Pair(_, a, b) => 1 + a.n_operation() + b.n_operation(),
            Self::If(c, a, b) => 2 + c.n_operation() + a.n_operation() + b.n_operation(),
        }
    }

    /// Writes code for the tree's value.
    fn written(&self, writer: &mut Writer) -> Operand {
        match self {
            Self::Leaf(source) => writer.read(*source),
            Self::Call(function, a) => {
                let a = a.written(writer);
                writer.call(*function, a)
            }
            Self::Power(a, n) => {
                let a = a.written(writer);
                writer.power(a, *n)
            }
            Self::Delay(input, tau) => {
                let tau = tau.written(writer);
                writer.delay(*input, tau)
            }
            Self::DelayedSlope(input, tau) => {
                let tau = tau.written(writer);
                writer.delayed_slope(*input, tau)
            }
            Self::Pair(operation, a, b) => {
                let (a, b) = (a.written(writer), b.written(writer));
                writer.pair(*operation, a, b)
            }
            Self::If(c, a, b) => {
                let (c, a, b) = (c.written(writer), a.written(writer), b.written(writer));
                writer.choose(c, a, b)
            }
        }
    }
}

/// An operation on two trees, worked out now where both are numbers.
fn fold(operation: Operation, a: Tree, b: Tree) -> Tree {
    if let (Some(x), Some(y)) = (number(&a), number(&b)) {
        return constant(match whole(y) {
            Some(n) if operation == Operation::Pow => values::power(x, n),
            _ => values::pair(operation, x, y),
        });
    }
    if operation == Operation::Pow
        && let Some(n) = number(&b).and_then(whole)
    {
        return Tree::Power(Box::new(a), n);
    }
    Tree::Pair(operation, Box::new(a), Box::new(b))
}

fn whole(exponent: f64) -> Option<i32> {
    (exponent.abs() <= MAX_POWER && exponent.fract().abs() < f64::MIN_POSITIVE).then_some(exponent as i32)
}

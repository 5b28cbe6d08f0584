//! From a syntax tree to flat code: names become slots, constants are folded, whole powers become products.
//!
//! Next file to read: [`super::program`], which runs the code.

use super::at::Slot;
use super::expression_error::ExpressionError;
use super::node::{Name, Node, Operation};
use super::program::{MAX_STACK, Op, Program};
use super::values::{self, Source};

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
    let mut compiler = Compiler { resolve, nearest, code: Vec::new(), height: 0, highest: 0 };
    let tree = compiler.resolved(node)?;
    compiler.emit(&tree)?;
    Ok(Program { code: compiler.code, stack: compiler.highest })
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
    code: Vec<Op>,
    height: usize,
    highest: usize,
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
            let hint =
                (self.nearest)(&name.text).map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
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

    fn op(&mut self, op: Op) {
        self.code.push(op);
    }

    fn push(&mut self, source: Source) -> Result<(), ExpressionError> {
        self.op(Op::Push(source));
        self.height += 1;
        self.highest = self.highest.max(self.height);
        if self.highest > MAX_STACK {
            return Err(ExpressionError::new(1, "nested too deep: split it into several outputs or states"));
        }
        Ok(())
    }

    /// Appends code that leaves the tree's value on top.
    fn emit(&mut self, tree: &Tree) -> Result<(), ExpressionError> {
        match tree {
            Tree::Leaf(source) => self.push(*source)?,
            Tree::Call(function, a) => {
                self.emit(a)?;
                self.op(Op::Call(*function));
            }
            Tree::Power(a, n) => {
                self.emit(a)?;
                self.op(Op::Power(*n));
            }
            Tree::Delay(input, tau) => {
                self.emit(tau)?;
                self.op(Op::Delay(*input));
            }
            Tree::DelayedSlope(input, tau) => {
                self.emit(tau)?;
                self.op(Op::DelayedSlope(*input));
            }
            Tree::Pair(operation, a, b) => {
                self.emit(a)?;
                if let Tree::Leaf(source) = **b {
                    self.op(Op::PairWith(*operation, source));
                } else {
                    self.emit(b)?;
                    self.op(Op::Pair(*operation));
                    self.height -= 1;
                }
            }
            Tree::If(c, a, b) => {
                self.emit(c)?;
                let unless = self.code.len();
                self.op(Op::Unless(0));
                self.height -= 1;
                self.emit(a)?;
                let jump = self.code.len();
                self.op(Op::Jump(0));
                self.height -= 1;
                self.code[unless] = Op::Unless(self.code.len() as u32);
                self.emit(b)?;
                self.code[jump] = Op::Jump(self.code.len() as u32);
            }
        }
        Ok(())
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

//! Calls of functions.
//!
//! Next file to read: [`super::super::compile`].

use super::{FUNCTIONS, Parser};
use crate::equations::ExpressionError;
use crate::equations::node::{Function, Name, Node, Operation};
use crate::{meant, nearest};

impl Parser {
    /// A call, from behind its opening parenthesis.
    pub(super) fn call(&mut self, name: &Name) -> Result<Node, ExpressionError> {
        let one = match name.text.as_str() {
            "sin" => Function::Sin,
            "cos" => Function::Cos,
            "tan" => Function::Tan,
            "exp" => Function::Exp,
            "log" => Function::Log,
            "sqrt" => Function::Sqrt,
            "abs" => Function::Abs,
            "sign" => Function::Sign,
            "tanh" => Function::Tanh,
            "step" => Function::Step,
            "min" => return self.arguments(name).map(|[a, b]| pair(Operation::Min, a, b)),
            "max" => return self.arguments(name).map(|[a, b]| pair(Operation::Max, a, b)),
            "if" => {
                let [c, a, b] = self.arguments(name)?;
                return Ok(Node::If(Box::new(c), Box::new(a), Box::new(b)));
            }
            "delay" => {
                let column = self.signal_column();
                let [u, tau] = self.arguments(name)?;
                return Ok(Node::Delay(signal(u, name, column)?, Box::new(tau)));
            }
            "ddt" => {
                let column = self.signal_column();
                let [u] = self.arguments(name)?;
                return Ok(Node::Ddt(signal(u, name, column)?));
            }
            unknown => {
                let hint = match (elsewhere(unknown), nearest(unknown, FUNCTIONS)) {
                    (Some(here), _) => format!("; {here}"),
                    (None, near @ Some(_)) => meant(near),
                    (None, None) => format!("; a product is written `{unknown}*(...)`"),
                };
                return Err(ExpressionError::new(
                    name.column,
                    format!("no function named `{unknown}`{hint}"),
                ));
            }
        };
        let [a] = self.arguments(name)?;
        Ok(Node::Call(one, Box::new(a)))
    }

    fn signal_column(&mut self) -> usize {
        self.peek();
        self.column()
    }

    /// Exactly `N` arguments and the closing parenthesis.
    fn arguments<const N: usize>(&mut self, name: &Name) -> Result<[Node; N], ExpressionError> {
        let mut list = Vec::with_capacity(N);
        loop {
            list.push(self.expression(0)?);
            let last = list.len() == N;
            match self.peek() {
                Some(',') if !last => self.at += 1,
                Some(')') if last => {
                    self.at += 1;
                    break;
                }
                Some(',' | ')') => {
                    let plural = if N == 1 { "" } else { "s" };
                    let message = format!("`{}` takes {N} argument{plural}", name.text);
                    let expected = if last { "`)`" } else { "`,`" };
                    return Err(ExpressionError::new(
                        self.column(),
                        format!("{message}: expected {expected}"),
                    ));
                }
                _ => {
                    return Err(self.unexpected(if last {
                        "an operator or `)`"
                    } else {
                        "an operator or `,`"
                    }));
                }
            }
        }
        list.try_into().map_err(|_| ExpressionError::new(name.column, "wrong number of arguments"))
    }
}

fn pair(operation: Operation, a: Node, b: Node) -> Node {
    Node::Pair(operation, Box::new(a), Box::new(b))
}

/// The bare name that `delay` and `ddt` need as first argument.
fn signal(node: Node, of: &Name, column: usize) -> Result<Name, ExpressionError> {
    match node {
        Node::Name(name) => Ok(name),
        _ => Err(ExpressionError::new(
            column,
            format!("`{}` needs the name of an input or an output", of.text),
        )),
    }
}

/// What a function of other languages is called here.
fn elsewhere(name: &str) -> Option<&'static str> {
    Some(match name {
        "ln" => "the natural logarithm is `log`",
        "log10" => "write `log(x)/log(10)`",
        "pow" | "power" => "a power is written `a^b`",
        "fabs" => "the magnitude is `abs`",
        "heaviside" => "it is `step` here",
        _ => return None,
    })
}

//! The unit of an expression, from the units of its names, and where its parts contradict each other.
//!
//! What has no known unit goes with anything. A number is one beside `+` and in comparisons, where it has the other side's
//! unit, and plain in products; its factor there may convert units, so only the dimension is judged. Nothing is evaluated.
//! Next file to read: [`crate::units::Labels`].

use super::expression::Expression;
use super::node::{Function, Name, Node, Operation};
use crate::units::Unit;

/// What is known of the unit of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Measure {
    /// Nothing.
    Unknown,
    /// It is a number, or made of numbers.
    Number,
    /// Its unit; when not `exact`, only the dimension of it.
    Known {
        /// The unit.
        unit: Unit,
        /// Whether the unit's factor is known too.
        exact: bool,
    },
}

/// Two things in one expression that cannot both be true.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Conflict {
    /// Which part, such as `the argument of exp`.
    pub(crate) part: &'static str,
    pub(crate) found: Measure,
    pub(crate) expected: Measure,
}

/// The unit of a name, and of time.
pub(crate) struct Scope<'a> {
    pub(crate) of: &'a dyn Fn(&str) -> Measure,
    pub(crate) time: Measure,
}

const PLAIN: Measure = Measure::Known { unit: Unit::ONE, exact: true };

impl Measure {
    /// Whether both can be the unit of one quantity.
    pub(crate) fn goes_with(self, other: Self) -> bool {
        match (self, other) {
            (Self::Known { unit: a, exact: true }, Self::Known { unit: b, exact: true }) => a.same(&b),
            (Self::Known { unit: a, .. }, Self::Known { unit: b, .. }) => a.same_dimension(&b),
            _ => true,
        }
    }

    /// The unit as text; nothing unless it is known.
    pub(crate) fn text(self) -> Option<String> {
        match self {
            Self::Known { unit, exact: true } => Some(unit.text()),
            Self::Known { unit, exact: false } => Some(Unit { factor: 1.0, ..unit }.text()),
            Self::Unknown | Self::Number => None,
        }
    }

    /// The unit of a product, or of a quotient when `sign` is −1.
    pub(crate) fn combined(self, other: Self, sign: f64) -> Self {
        match (self, other) {
            (Self::Unknown, _) | (_, Self::Unknown) => Self::Unknown,
            (Self::Number, Self::Number) => Self::Number,
            (Self::Known { unit, .. }, Self::Number) => Self::Known { unit, exact: false },
            (Self::Number, Self::Known { unit, .. }) => Self::Known { unit: unit.power(sign), exact: false },
            (Self::Known { unit: a, exact: p }, Self::Known { unit: b, exact: q }) => {
                Self::Known { unit: a.times(b.power(sign)), exact: p && q }
            }
        }
    }

    fn raised(self, exponent: f64) -> Self {
        match self {
            Self::Known { unit, exact } => Self::Known { unit: unit.power(exponent), exact },
            other => other,
        }
    }
}

/// The unit of an expression; what its parts contradict in is added to `conflicts`.
pub(crate) fn measure(expression: &Expression, scope: &Scope<'_>, conflicts: &mut Vec<Conflict>) -> Measure {
    Walk { scope, conflicts }.measure(expression.node())
}

struct Walk<'a, 'b> {
    scope: &'a Scope<'b>,
    conflicts: &'a mut Vec<Conflict>,
}

impl Walk<'_, '_> {
    fn measure(&mut self, node: &Node) -> Measure {
        match node {
            Node::Number(_) => Measure::Number,
            Node::Time => self.scope.time,
            Node::Name(name) => self.name(name),
            Node::Call(function, a) => self.call(*function, a),
            Node::Pair(operation, a, b) => self.pair(*operation, a, b),
            Node::If(condition, a, b) => {
                self.measure(condition);
                self.alike("a branch of `if`", a, b)
            }
            Node::Delay(name, tau) => {
                let found = self.measure(tau);
                let time = self.scope.time;
                self.expect("the time of `delay`", found, time);
                self.name(name)
            }
            Node::Ddt(name) | Node::DelayedSlope(name, _) => self.name(name).combined(self.scope.time, -1.0),
        }
    }

    fn name(&self, name: &Name) -> Measure {
        (self.scope.of)(&name.text)
    }

    fn call(&mut self, function: Function, a: &Node) -> Measure {
        let found = self.measure(a);
        let part = match function {
            Function::Neg | Function::Abs => return found,
            Function::Sqrt => return found.raised(0.5),
            Function::Sign | Function::Step => return Measure::Number,
            Function::Sin => "the argument of `sin`",
            Function::Cos => "the argument of `cos`",
            Function::Tan => "the argument of `tan`",
            Function::Exp => "the argument of `exp`",
            Function::Log => "the argument of `log`",
            Function::Tanh => "the argument of `tanh`",
        };
        // In `sin(6.28*t)` and `tanh(v/0.002)` the number has the unit that makes the argument plain: a frequency, a speed.
        let has_number = matches!(found, Measure::Known { exact: false, .. });
        let mut named = false;
        a.walk(&mut |part| named |= part.name().is_some());
        if named && !has_number {
            self.expect(part, found, PLAIN);
        }
        Measure::Number
    }

    fn pair(&mut self, operation: Operation, a: &Node, b: &Node) -> Measure {
        match operation {
            Operation::Add => self.alike("one side of a sum", b, a),
            Operation::Sub => self.alike("one side of a difference", b, a),
            Operation::Min => self.alike("an argument of `min`", b, a),
            Operation::Max => self.alike("an argument of `max`", b, a),
            Operation::Mul => self.measure(a).combined(self.measure(b), 1.0),
            Operation::Div => self.measure(a).combined(self.measure(b), -1.0),
            Operation::Pow => self.power(a, b),
            _ => {
                self.alike("one side of a comparison", b, a);
                Measure::Number
            }
        }
    }

    /// Two parts that must have one unit, which is that of the whole.
    fn alike(&mut self, part: &'static str, found: &Node, expected: &Node) -> Measure {
        let expected = self.measure(expected);
        let found = self.measure(found);
        if !self.expect(part, found, expected) {
            return Measure::Unknown;
        }
        match (found, expected) {
            (Measure::Known { exact: false, .. }, Measure::Known { .. }) => expected,
            (Measure::Known { .. }, _) => found,
            (_, Measure::Known { .. }) => expected,
            (Measure::Number, Measure::Number) => Measure::Number,
            _ => Measure::Unknown,
        }
    }

    fn power(&mut self, base: &Node, exponent: &Node) -> Measure {
        let found = self.measure(base);
        if let Some(n) = literal(exponent) {
            return found.raised(n);
        }
        let of_exponent = self.measure(exponent);
        self.expect("an exponent", of_exponent, PLAIN);
        match found {
            Measure::Number => Measure::Number,
            Measure::Known { unit, .. } if unit.same_dimension(&Unit::ONE) => Measure::Number,
            _ => Measure::Unknown,
        }
    }

    fn expect(&mut self, part: &'static str, found: Measure, expected: Measure) -> bool {
        let fine = found.goes_with(expected);
        if !fine {
            self.conflicts.push(Conflict { part, found, expected });
        }
        fine
    }
}

/// The value of an exponent that is written as a number, such as `2`, `-1` or `(1/3)`.
fn literal(node: &Node) -> Option<f64> {
    match node {
        Node::Number(n) => Some(*n),
        Node::Call(Function::Neg, a) => Some(-literal(a)?),
        Node::Pair(Operation::Div, a, b) => Some(literal(a)? / literal(b)?).filter(|n| n.is_finite()),
        _ => None,
    }
}

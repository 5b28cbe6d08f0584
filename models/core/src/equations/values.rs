//! What the operations of an expression give, and the interpreter's way to plain values.
//!
//! Next file to read: [`super::dual`], which adds a derivative to each.

use super::at::At;
use super::node::{Function, Operation};

/// Where an operand is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    Number(f64),
    Time,
    State(u32),
    Parameter(u32),
    Input(u32),
    Output(u32),
    /// Slope of an input on the current segment.
    Slope(u32),
}

/// What differs between the two interpreters.
pub(super) trait Reader {
    type Number: Copy + Default;
    fn read(&self, source: Source) -> Self::Number;
    fn call(function: Function, a: Self::Number) -> Self::Number;
    fn pair(operation: Operation, a: Self::Number, b: Self::Number) -> Self::Number;
    fn power(a: Self::Number, n: i32) -> Self::Number;
    fn delay(&self, input: usize, tau: Self::Number) -> Self::Number;
    fn delayed_slope(&self, input: usize, tau: Self::Number) -> Self::Number;
    fn is_zero(a: Self::Number) -> bool;
}

#[allow(clippy::float_cmp)] // the language's `==` and `!=` are exact by definition
#[inline]
pub(super) fn pair(operation: Operation, a: f64, b: f64) -> f64 {
    let truth = |holds: bool| f64::from(u8::from(holds));
    match operation {
        Operation::Add => a + b,
        Operation::Sub => a - b,
        Operation::Mul => a * b,
        Operation::Div => a / b,
        Operation::Pow => a.powf(b),
        Operation::Min => {
            if b < a {
                b
            } else {
                a
            }
        }
        Operation::Max => {
            if b > a {
                b
            } else {
                a
            }
        }
        Operation::Less => truth(a < b),
        Operation::LessEqual => truth(a <= b),
        Operation::Greater => truth(a > b),
        Operation::GreaterEqual => truth(a >= b),
        Operation::Equal => truth(a == b),
        Operation::NotEqual => truth(a != b),
    }
}

#[inline]
pub(super) fn call(function: Function, a: f64) -> f64 {
    match function {
        Function::Neg => -a,
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Tan => a.tan(),
        Function::Exp => a.exp(),
        Function::Log => a.ln(),
        Function::Sqrt => a.sqrt(),
        Function::Abs => a.abs(),
        Function::Sign => sign(a),
        Function::Tanh => a.tanh(),
        Function::Step => {
            if a >= 0.0 {
                1.0
            } else if a < 0.0 {
                0.0
            } else {
                f64::NAN
            }
        }
    }
}

#[inline]
pub(super) fn sign(a: f64) -> f64 {
    if a > 0.0 {
        1.0
    } else if a < 0.0 {
        -1.0
    } else {
        // Zero stays zero and NaN stays NaN.
        a
    }
}

/// aⁿ by repeated squaring.
#[inline]
pub(super) fn power(a: f64, n: i32) -> f64 {
    let (mut base, mut left, mut result) = (a, n.unsigned_abs(), 1.0);
    while left > 0 {
        if left & 1 == 1 {
            result *= base;
        }
        base *= base;
        left >>= 1;
    }
    if n < 0 { 1.0 / result } else { result }
}

/// Slope of a delayed input: inputs are linear between samples, so a short difference is exact away from the samples.
pub(super) fn delayed_slope(at: &At<'_>, input: usize, tau: f64) -> f64 {
    let (s, h) = (at.t - tau, 1e-7 * at.t.abs().max(tau.abs()).max(1e-3));
    (at.u.history.at(input, s + h) - at.u.history.at(input, s - h)) / (2.0 * h)
}

/// Plain values.
pub(super) struct Values<'a, 'b>(pub(super) &'a At<'b>);

impl Reader for Values<'_, '_> {
    type Number = f64;

    #[inline]
    fn read(&self, source: Source) -> f64 {
        match source {
            Source::Number(n) => n,
            Source::Time => self.0.t,
            Source::State(i) => self.0.x[i as usize],
            Source::Parameter(i) => self.0.theta[i as usize],
            Source::Input(i) => self.0.u.value[i as usize],
            Source::Output(i) => self.0.y[i as usize],
            Source::Slope(i) => self.0.u.slope[i as usize],
        }
    }

    #[inline]
    fn call(function: Function, a: f64) -> f64 {
        call(function, a)
    }

    #[inline]
    fn pair(operation: Operation, a: f64, b: f64) -> f64 {
        pair(operation, a, b)
    }

    #[inline]
    fn power(a: f64, n: i32) -> f64 {
        power(a, n)
    }

    fn delay(&self, input: usize, tau: f64) -> f64 {
        // A record can be read ahead; what the run itself makes cannot.
        if tau < 0.0 && input >= self.0.u.value.len() {
            return f64::NAN;
        }
        self.0.u.history.at(input, self.0.t - tau)
    }

    fn delayed_slope(&self, input: usize, tau: f64) -> f64 {
        delayed_slope(self.0, input, tau)
    }

    fn is_zero(a: f64) -> bool {
        // NaN is no truth: it takes the second branch, as a comparison with NaN does.
        a.is_nan() || a.abs() <= 0.0
    }
}

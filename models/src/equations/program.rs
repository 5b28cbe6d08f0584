//! Flat code for an expression, and its two interpreters: values, and values with a directional derivative.
//!
//! A stack machine whose topmost entry stays in a register; nothing is allocated. Next file to read: [`super::dual`].

use super::dual::{Along, Dual};
use super::expression::{At, Direction};
use super::node::{Function, Operation};

/// Deepest stack of any program; deeper expressions are refused when compiled.
pub(super) const MAX_STACK: usize = 64;
/// Depth that most programs stay within; it spares them the clearing of a large stack.
const SMALL_STACK: usize = 8;

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

/// One instruction. `top` is the register, `pop` the entry below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Op {
    /// Saves `top` on the stack and reads a new one.
    Push(Source),
    /// `top = f(top)`.
    Call(Function),
    /// `top = pop ∘ top`.
    Pair(Operation),
    /// `top = top ∘ operand`.
    PairWith(Operation, Source),
    /// `top = topⁿ`.
    Power(i32),
    /// `top = input(t - top)`.
    Delay(u32),
    /// `top = slope of input at t - top`.
    DelayedSlope(u32),
    /// Drops `top`; goes to the instruction if it was zero.
    Unless(u32),
    /// Goes to the instruction.
    Jump(u32),
}

/// A compiled expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) code: Vec<Op>,
    /// Entries that the stack holds at most.
    pub(super) stack: usize,
}

impl Program {
    /// The expression's value.
    ///
    /// # Panics
    /// When a slice in `at` is shorter than the slots that the program was compiled with.
    #[inline]
    pub fn eval(&self, at: &At<'_>) -> f64 {
        if self.stack <= SMALL_STACK {
            run::<_, SMALL_STACK>(&self.code, &Values(at))
        } else {
            run::<_, MAX_STACK>(&self.code, &Values(at))
        }
    }

    /// The expression's value and its derivative along `direction`.
    ///
    /// At a kink the derivative is that of one side: `sign(0)` = 0 for `abs`, the first argument for `min` and `max`.
    ///
    /// # Panics
    /// When a slice in `at` is shorter than the slots that the program was compiled with.
    pub fn eval_dual(&self, at: &At<'_>, direction: &Direction<'_>) -> (f64, f64) {
        let reader = Along(at, direction);
        let Dual(value, slope) = if self.stack <= SMALL_STACK {
            run::<_, SMALL_STACK>(&self.code, &reader)
        } else {
            run::<_, MAX_STACK>(&self.code, &reader)
        };
        (value, slope)
    }

    /// Number of operations left after constants were folded.
    pub fn n_operations(&self) -> usize {
        self.code.len()
    }
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

#[inline]
fn run<R: Reader, const N: usize>(code: &[Op], reader: &R) -> R::Number {
    let mut stack = [R::Number::default(); N];
    let mut height = 0;
    let mut top = R::Number::default();
    let mut next = 0;
    while let Some(op) = code.get(next) {
        next += 1;
        match *op {
            Op::Push(source) => {
                stack[height] = top;
                height += 1;
                top = reader.read(source);
            }
            Op::PairWith(operation, source) => top = R::pair(operation, top, reader.read(source)),
            Op::Pair(operation) => {
                height -= 1;
                top = R::pair(operation, stack[height], top);
            }
            Op::Call(function) => top = R::call(function, top),
            Op::Power(n) => top = R::power(top, n),
            Op::Delay(input) => top = reader.delay(input as usize, top),
            Op::DelayedSlope(input) => top = reader.delayed_slope(input as usize, top),
            Op::Unless(target) => {
                if R::is_zero(top) {
                    next = target as usize;
                }
                height -= 1;
                top = stack[height];
            }
            Op::Jump(target) => next = target as usize,
        }
    }
    top
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

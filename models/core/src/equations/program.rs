//! Flat code for an expression, and its two interpreters: values, and values with a directional derivative.
//!
//! A stack machine whose topmost entry stays in a register; nothing is allocated. Next file to read: [`super::dual`].

use super::at::{At, Direction};
use super::dual::{Along, Dual};
use super::node::{Function, Operation};
use super::values::{Reader, Source, Values};

/// Deepest stack of any program; deeper expressions are refused when compiled.
pub(super) const MAX_STACK: usize = 64;
/// Depth that most programs stay within; it spares them the clearing of a large stack.
const SMALL_STACK: usize = 8;

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

//! Flat code for one or several expressions, and its two interpreters: values, and values with a directional derivative.
//!
//! A register machine: what the code reads stands in the first registers, then every operation writes the next one, and nothing is
//! allocated for code of ordinary length. What occurs several times, within an expression or in several, is computed once. Both sides
//! of an `if` are computed and one is taken, which is cheaper than a jump and the same, since nothing has a side effect. Next
//! file to read: [`super::dual`].

use std::collections::HashMap;

use super::node::{Function, Operation};
use super::values::{Reader, Source};

/// A register: what is read first, then the results of the operations in their order.
pub(super) type Register = u32;

/// One operation. Operands are registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    Add(Register, Register),
    Sub(Register, Register),
    Mul(Register, Register),
    Div(Register, Register),
    /// Any other operation on two.
    Pair(Operation, Register, Register),
    Neg(Register),
    /// Any other function of one.
    Call(Function, Register),
    /// A whole power.
    Power(Register, i32),
    /// The second where the first is true, else the third.
    Choose(Register, Register, Register),
    /// An input so long ago.
    Delay(u32, Register),
    /// The slope of an input so long ago.
    DelayedSlope(u32, Register),
}

impl Op {
    /// The same operation on other registers.
    fn map(self, to: impl Fn(Register) -> Register) -> Self {
        match self {
            Self::Add(a, b) => Self::Add(to(a), to(b)),
            Self::Sub(a, b) => Self::Sub(to(a), to(b)),
            Self::Mul(a, b) => Self::Mul(to(a), to(b)),
            Self::Div(a, b) => Self::Div(to(a), to(b)),
            Self::Pair(operation, a, b) => Self::Pair(operation, to(a), to(b)),
            Self::Neg(a) => Self::Neg(to(a)),
            Self::Call(function, a) => Self::Call(function, to(a)),
            Self::Power(a, n) => Self::Power(to(a), n),
            Self::Choose(c, a, b) => Self::Choose(to(c), to(a), to(b)),
            Self::Delay(input, tau) => Self::Delay(input, to(tau)),
            Self::DelayedSlope(input, tau) => Self::DelayedSlope(input, to(tau)),
        }
    }
}

/// Code for expressions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tape {
    reads: Vec<Source>,
    ops: Vec<Op>,
    /// The register of every expression's value.
    results: Vec<Register>,
}

/// Registers that stand on the stack; longer code takes them from the heap.
const SMALL: usize = 16;
const MIDDLE: usize = 64;
const LARGE: usize = 256;

impl Tape {
    /// The code of several, as one.
    pub(super) fn joined<'a>(tapes: impl IntoIterator<Item = &'a Tape>) -> Self {
        let mut writer = Writer::default();
        let mut results = Vec::new();
        for tape in tapes {
            let mut at: Vec<Operand> = tape.reads.iter().map(|source| writer.read(*source)).collect();
            for op in &tape.ops {
                let op = op.map(|register| at[register as usize].0);
                at.push(writer.op(op));
            }
            results.extend(tape.results.iter().map(|register| at[*register as usize]));
        }
        writer.finish(&results)
    }

    /// Evaluates all expressions and hands on the value of each with its position.
    #[inline]
    pub(super) fn each<R: Reader>(&self, reader: &R, take: impl FnMut(usize, R::Number)) {
        let (n, zero) = (self.reads.len() + self.ops.len(), R::Number::default());
        if n <= SMALL {
            self.run(reader, &mut [zero; SMALL], take);
        } else if n <= MIDDLE {
            self.run(reader, &mut [zero; MIDDLE], take);
        } else if n <= LARGE {
            self.run(reader, &mut [zero; LARGE], take);
        } else {
            self.run(reader, &mut vec![zero; n.next_power_of_two()][..], take);
        }
    }

    /// Number of expressions.
    pub(super) fn n_result(&self) -> usize {
        self.results.len()
    }

    /// With room for the registers, a power of two of them.
    #[inline]
    fn run<R: Reader>(
        &self,
        reader: &R,
        registers: &mut (impl AsMut<[R::Number]> + ?Sized),
        mut take: impl FnMut(usize, R::Number),
    ) {
        let registers = registers.as_mut();
        // No register is beyond the room: the mask says so to the compiler.
        let mask = registers.len() - 1;
        for (register, source) in registers.iter_mut().zip(&self.reads) {
            *register = reader.read(*source);
        }
        for (next, op) in (self.reads.len()..).zip(&self.ops) {
            let of = |register: Register| registers[register as usize & mask];
            let value = match *op {
                Op::Add(a, b) => R::pair(Operation::Add, of(a), of(b)),
                Op::Sub(a, b) => R::pair(Operation::Sub, of(a), of(b)),
                Op::Mul(a, b) => R::pair(Operation::Mul, of(a), of(b)),
                Op::Div(a, b) => R::pair(Operation::Div, of(a), of(b)),
                Op::Pair(operation, a, b) => R::pair(operation, of(a), of(b)),
                Op::Neg(a) => R::call(Function::Neg, of(a)),
                Op::Call(function, a) => R::call(function, of(a)),
                Op::Power(a, n) => R::power(of(a), n),
                Op::Choose(c, a, b) => of(if R::is_zero(of(c)) { b } else { a }),
                Op::Delay(input, tau) => reader.delay(input as usize, of(tau)),
                Op::DelayedSlope(input, tau) => reader.delayed_slope(input as usize, of(tau)),
            };
            registers[next & mask] = value;
        }
        for (i, register) in self.results.iter().enumerate() {
            take(i, registers[*register as usize & mask]);
        }
    }
}

/// Marks the result of an operation among operands; what is read has none.
const RESULT: u32 = 1 << 31;

/// What is read, or the result of an operation, by its position, while it is open how much is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operand(u32);

/// Writes code, each operation once.
#[derive(Default)]
pub(super) struct Writer {
    reads: Vec<Source>,
    ops: Vec<Op>,
    known: HashMap<Op, u32>,
}

impl Writer {
    /// Reads a value.
    pub(super) fn read(&mut self, source: Source) -> Operand {
        let same = |known: &Source| match (known, &source) {
            // Zeros of two signs are two numbers.
            (Source::Number(a), Source::Number(b)) => a.to_bits() == b.to_bits(),
            (known, source) => known == source,
        };
        let at = self.reads.iter().position(same).unwrap_or_else(|| {
            self.reads.push(source);
            self.reads.len() - 1
        });
        Operand(at as u32)
    }

    /// Makes an operation, whose registers are the numbers of operands.
    fn op(&mut self, op: Op) -> Operand {
        let ops = &mut self.ops;
        let at = self.known.entry(op).or_insert_with(|| {
            ops.push(op);
            (ops.len() - 1) as u32
        });
        Operand(*at | RESULT)
    }

    pub(super) fn call(&mut self, function: Function, a: Operand) -> Operand {
        self.op(if function == Function::Neg { Op::Neg(a.0) } else { Op::Call(function, a.0) })
    }

    pub(super) fn pair(&mut self, operation: Operation, a: Operand, b: Operand) -> Operand {
        self.op(match operation {
            Operation::Add => Op::Add(a.0, b.0),
            Operation::Sub => Op::Sub(a.0, b.0),
            Operation::Mul => Op::Mul(a.0, b.0),
            Operation::Div => Op::Div(a.0, b.0),
            other => Op::Pair(other, a.0, b.0),
        })
    }

    pub(super) fn power(&mut self, a: Operand, n: i32) -> Operand {
        self.op(Op::Power(a.0, n))
    }

    pub(super) fn choose(&mut self, condition: Operand, a: Operand, b: Operand) -> Operand {
        self.op(Op::Choose(condition.0, a.0, b.0))
    }

    pub(super) fn delay(&mut self, input: u32, tau: Operand) -> Operand {
        self.op(Op::Delay(input, tau.0))
    }

    pub(super) fn delayed_slope(&mut self, input: u32, tau: Operand) -> Operand {
        self.op(Op::DelayedSlope(input, tau.0))
    }

    /// The code with these values.
    pub(super) fn finish(self, results: &[Operand]) -> Tape {
        let n = self.reads.len() as u32;
        let register = |operand: u32| if operand & RESULT == 0 { operand } else { n + (operand & !RESULT) };
        Tape {
            ops: self.ops.iter().map(|op| op.map(register)).collect(),
            results: results.iter().map(|operand| register(operand.0)).collect(),
            reads: self.reads,
        }
    }
}

//! Values with their derivatives along directions: forward mode (Griewank & Walther 2008, ch. 3).
//!
//! At a kink the derivative is that of one side. Next file to read: [`super::model`].

use super::at::{At, Direction};
use super::node::{Function, Operation};
use super::values::{Reader, Source, Values, call, delayed_slope, pair, power, sign};

/// A value and its derivatives along so many directions.
#[derive(Clone, Copy)]
pub(super) struct Dual<const N: usize>(pub(super) f64, pub(super) [f64; N]);

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self(0.0, [0.0; N])
    }
}

/// Values at a point, derivatives along directions.
pub(super) struct Along<'a, 'b, 'c, 'd, const N: usize>(
    pub(super) &'a At<'b>,
    pub(super) &'c [Direction<'d>; N],
);

/// `factor * slope`, zero when nothing moves even where the factor is infinite.
fn chain(factor: f64, slope: f64) -> f64 {
    if slope.abs() <= 0.0 { 0.0 } else { factor * slope }
}

impl<const N: usize> Reader for Along<'_, '_, '_, '_, N> {
    type Number = Dual<N>;

    fn read(&self, source: Source) -> Dual<N> {
        let part = |slice: &[f64], i: u32| slice.get(i as usize).copied().unwrap_or(0.0);
        let slope = |direction: &Direction<'_>| match source {
            // Inputs are linear on a segment: their slopes do not move.
            Source::Number(_) | Source::Slope(_) => 0.0,
            Source::Time => direction.t,
            Source::State(i) => part(direction.x, i),
            Source::Parameter(i) => part(direction.theta, i),
            Source::Input(i) => part(direction.u, i),
            Source::Output(i) => part(direction.y, i),
        };
        Dual(Values(self.0).read(source), self.1.each_ref().map(slope))
    }

    fn call(function: Function, Dual(a, da): Dual<N>) -> Dual<N> {
        let value = call(function, a);
        let factor = match function {
            Function::Neg => -1.0,
            Function::Sin => a.cos(),
            Function::Cos => -a.sin(),
            Function::Tan => 1.0 + value * value,
            Function::Exp => value,
            Function::Log => 1.0 / a,
            Function::Sqrt => 0.5 / value,
            Function::Abs => sign(a),
            Function::Sign | Function::Step => 0.0,
            Function::Tanh => 1.0 - value * value,
        };
        Dual(value, da.map(|da| chain(factor, da)))
    }

    fn pair(operation: Operation, Dual(a, da): Dual<N>, Dual(b, db): Dual<N>) -> Dual<N> {
        let value = pair(operation, a, b);
        let slopes = match operation {
            Operation::Add => std::array::from_fn(|k| da[k] + db[k]),
            Operation::Sub => std::array::from_fn(|k| da[k] - db[k]),
            Operation::Mul => std::array::from_fn(|k| da[k] * b + a * db[k]),
            Operation::Div => std::array::from_fn(|k| (da[k] - value * db[k]) / b),
            // 0^b stays 0 when a positive b moves, although log 0 is infinite.
            Operation::Pow => {
                let along_b = if value.abs() <= 0.0 { 0.0 } else { value * a.ln() };
                let along_a = b * a.powf(b - 1.0);
                std::array::from_fn(|k| chain(along_a, da[k]) + chain(along_b, db[k]))
            }
            Operation::Min => {
                if b < a {
                    db
                } else {
                    da
                }
            }
            Operation::Max => {
                if b > a {
                    db
                } else {
                    da
                }
            }
            _ => [0.0; N],
        };
        Dual(value, slopes)
    }

    fn power(Dual(a, da): Dual<N>, n: i32) -> Dual<N> {
        let factor = if n == 0 { 0.0 } else { f64::from(n) * power(a, n - 1) };
        Dual(power(a, n), da.map(|da| chain(factor, da)))
    }

    fn delay(&self, input: usize, Dual(tau, dtau): Dual<N>) -> Dual<N> {
        let factor = delayed_slope(self.0, input, tau);
        let slopes = std::array::from_fn(|k| chain(factor, self.1[k].t - dtau[k]));
        Dual(Values(self.0).delay(input, tau), slopes)
    }

    fn delayed_slope(&self, input: usize, Dual(tau, _): Dual<N>) -> Dual<N> {
        Dual(delayed_slope(self.0, input, tau), [0.0; N])
    }

    fn is_zero(Dual(a, _): Dual<N>) -> bool {
        Values::is_zero(a)
    }
}

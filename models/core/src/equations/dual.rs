//! Values with their derivative along a direction: forward mode (Griewank & Walther 2008, ch. 3).
//!
//! At a kink the derivative is that of one side. Next file to read: [`super::model`].

use super::at::{At, Direction};
use super::node::{Function, Operation};
use super::values::{Reader, Source, Values, call, delayed_slope, pair, power, sign};

/// A value and its derivative.
#[derive(Clone, Copy, Default)]
pub(super) struct Dual(pub(super) f64, pub(super) f64);

/// Values at a point, derivatives along a direction.
pub(super) struct Along<'a, 'b, 'c, 'd>(pub(super) &'a At<'b>, pub(super) &'c Direction<'d>);

/// `factor * slope`, zero when nothing moves even where the factor is infinite.
fn chain(factor: f64, slope: f64) -> f64 {
    if slope.abs() <= 0.0 { 0.0 } else { factor * slope }
}

impl Reader for Along<'_, '_, '_, '_> {
    type Number = Dual;

    fn read(&self, source: Source) -> Dual {
        let part = |slice: &[f64], i: u32| slice.get(i as usize).copied().unwrap_or(0.0);
        let slope = match source {
            // Inputs are linear on a segment: their slopes do not move.
            Source::Number(_) | Source::Slope(_) => 0.0,
            Source::Time => self.1.t,
            Source::State(i) => part(self.1.x, i),
            Source::Parameter(i) => part(self.1.theta, i),
            Source::Input(i) => part(self.1.u, i),
            Source::Output(i) => part(self.1.y, i),
        };
        Dual(Values(self.0).read(source), slope)
    }

    fn call(function: Function, Dual(a, da): Dual) -> Dual {
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
        Dual(value, chain(factor, da))
    }

    fn pair(operation: Operation, Dual(a, da): Dual, Dual(b, db): Dual) -> Dual {
        let value = pair(operation, a, b);
        let slope = match operation {
            Operation::Add => da + db,
            Operation::Sub => da - db,
            Operation::Mul => da * b + a * db,
            Operation::Div => (da - value * db) / b,
            // 0^b stays 0 when a positive b moves, although log 0 is infinite.
            Operation::Pow => {
                let along_b = if value.abs() <= 0.0 { 0.0 } else { value * a.ln() };
                chain(b * a.powf(b - 1.0), da) + chain(along_b, db)
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
            _ => 0.0,
        };
        Dual(value, slope)
    }

    fn power(Dual(a, da): Dual, n: i32) -> Dual {
        Dual(power(a, n), if n == 0 { 0.0 } else { chain(f64::from(n) * power(a, n - 1), da) })
    }

    fn delay(&self, input: usize, Dual(tau, dtau): Dual) -> Dual {
        let slope = chain(delayed_slope(self.0, input, tau), self.1.t - dtau);
        Dual(Values(self.0).delay(input, tau), slope)
    }

    fn delayed_slope(&self, input: usize, Dual(tau, _): Dual) -> Dual {
        Dual(delayed_slope(self.0, input, tau), 0.0)
    }

    fn is_zero(Dual(a, _): Dual) -> bool {
        Values::is_zero(a)
    }
}

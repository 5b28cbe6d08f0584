//! The step within the bounds, and where it leads.
//!
//! A component of exponential growth is moved along the straight line of the quantity behind it: what is proportional to that quantity
//! changes in proportion to the step, however long it is, and a valley between such quantities stays straight. Next file to read:
//! [`super::damped`].

use nalgebra::DVector;

use super::{LeastSquares, damped};

/// Longest step of one component, in units of z.
const LONGEST: f64 = 3.0;
/// Share of a growing quantity that a step leaves at least; in its logarithm such a step is 1.65 times as long as it would be by its first
/// derivative, so that one which goes to the prior mean still comes nearer to it.
const LEFT: f64 = 1.0 / 3.0;
/// Times that a step without a promise is halved.
const MOST_HALVINGS: usize = 6;

/// Solves for the free components, given what is left of the residual.
type Solve<'a> = dyn Fn(&[usize], &DVector<f64>) -> Option<DVector<f64>> + 'a;

/// A step, and whether it is as long as the linear model would have it.
struct Found {
    step: DVector<f64>,
    is_whole: bool,
}

impl LeastSquares {
    /// The damped step within the bounds; notes the fall of the cost that it predicts. Components at a bound that pull outwards
    /// are left where they are, and those that move no residual go to their prior mean last: a parameter inside a term whose
    /// amplitude is still zero has its influence where the amplitude is not.
    pub(super) fn find_step(&mut self) -> Option<DVector<f64>> {
        let felt = self.jacobian.squares();
        let step = self.step_of(&felt, &|j| felt[j] > 0.0)?;
        if self.thorough && self.predicted <= self.smallest() && felt.iter().any(|square| *square <= 0.0) {
            return self.step_of(&felt, &|_| true);
        }
        Some(step)
    }

    /// The step of the components that may move, whose columns have these squares.
    fn step_of(&mut self, felt: &DVector<f64>, moves: &dyn Fn(usize) -> bool) -> Option<DVector<f64>> {
        let p = self.z.len();
        let precision = &self.prior.precision;
        let pull = &self.prior.mean - &self.z;
        let of_data = self.jacobian.tr_times(&self.residual);
        let gradient = &of_data + precision.component_mul(&pull);
        let curvature = felt + precision;
        let held = |j: usize| {
            let [lo, hi] = self.prior.bounds[j];
            (self.z[j] <= lo && gradient[j] < 0.0) || (self.z[j] >= hi && gradient[j] > 0.0)
        };
        let free: Vec<usize> = (0..p).filter(|j| moves(*j) && !held(*j) && curvature[*j] > 0.0).collect();
        let promise = |step: &DVector<f64>| {
            let of_prior = self.prior.cost(&self.z) - self.prior.cost(&self.led(step));
            2.0 * of_data.dot(step) - self.jacobian.times(step).norm_squared() + of_prior
        };
        let solve = |free: &[usize], left: &DVector<f64>| damped::solve(self, free, left, &pull, &curvature);
        let mut found = self.stopped(&free, &solve)?;
        if promise(&found.step) <= 0.0 {
            // What one component loses at its end others cannot always make up for; the way to the minimum without ends leads downhill.
            found = self.cut(&free, &solve(&free, &self.residual)?);
        }
        let Found { mut step, mut is_whole } = found;
        let mut predicted = promise(&step);
        // The prior of what grows exponentially is no parabola along a step: a shorter one may lower its cost where the whole does not.
        for _ in 0..MOST_HALVINGS {
            if predicted > 0.0 {
                break;
            }
            step *= 0.5;
            is_whole = false;
            predicted = promise(&step);
        }
        self.predicted = predicted;
        self.length = curvature.component_mul(&step).dot(&step).sqrt();
        self.is_whole = is_whole && self.length < damped::USED * self.radius;
        Some(step)
    }

    /// The step on which components that would pass an end of their range stop there, one after the other, and the others are solved for anew:
    /// cutting all of them off could make a step that leads uphill.
    fn stopped(&self, free: &[usize], solve: &Solve<'_>) -> Option<Found> {
        let mut free = free.to_vec();
        let mut stopped = DVector::zeros(self.z.len());
        let mut is_whole = true;
        loop {
            let solved = solve(&free, &(&self.residual - self.jacobian.times(&stopped)))?;
            let mut step = stopped.clone();
            for (k, j) in free.iter().enumerate() {
                step[*j] = solved[k];
            }
            let shrink = (LONGEST / solved.amax().max(f64::MIN_POSITIVE)).min(1.0);
            let Some((k, end)) = self.first_stop(&free, &(&step * shrink)) else {
                // All of it is shortened alike: what stopped and what makes up for it belong together.
                return Some(Found { step: step * shrink, is_whole: is_whole && shrink >= 1.0 });
            };
            is_whole &= end > self.shortest(free[k]);
            stopped[free.remove(k)] = end;
        }
    }

    /// The way to the minimum as far as the first end of a range, or the longest step.
    fn cut(&self, free: &[usize], solved: &DVector<f64>) -> Found {
        let mut step = DVector::zeros(self.z.len());
        for (k, j) in free.iter().enumerate() {
            step[*j] = solved[k];
        }
        let stop = self.first_stop(free, &step).map_or(1.0, |(k, end)| (end / step[free[k]]).abs());
        let share = stop.min(LONGEST / solved.amax().max(f64::MIN_POSITIVE));
        Found { step: step * share, is_whole: share >= 1.0 }
    }

    /// The place among the free components of the one that a step takes to an end of its range first, and its step to that end.
    fn first_stop(&self, free: &[usize], step: &DVector<f64>) -> Option<(usize, f64)> {
        let mut first: Option<(usize, f64)> = None;
        let mut least = 1.0;
        for (k, &j) in free.iter().enumerate() {
            let [lo, hi] = self.ends(j);
            let end = if step[j] < 0.0 { lo } else { hi };
            if step[j].abs() > end.abs() && end.abs() / step[j].abs() < least {
                (least, first) = (end.abs() / step[j].abs(), Some((k, end)));
            }
        }
        first
    }

    /// The step of a component of exponential growth that leaves no more than it must of the quantity; of others there is none.
    fn shortest(&self, j: usize) -> f64 {
        (LEFT - 1.0) / self.prior.growth[j]
    }

    /// Shortest and longest step of a component.
    fn ends(&self, j: usize) -> [f64; 2] {
        let ([lo, hi], growth, z) = (self.prior.bounds[j], self.prior.growth[j], self.z[j]);
        if growth > 0.0 {
            let to = |end: f64| (growth * (end - z)).exp_m1() / growth;
            [to(lo).max(self.shortest(j)), to(hi)]
        } else {
            [lo - z, hi - z]
        }
    }

    /// Where a step leads.
    pub(super) fn led(&self, step: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(step.len(), |j, _| {
            let (growth, [lo, hi]) = (self.prior.growth[j], self.prior.bounds[j]);
            let by = if growth > 0.0 { (growth * step[j]).ln_1p() / growth } else { step[j] };
            (self.z[j] + by).clamp(lo, hi)
        })
    }

    /// The secant's Jacobian in the units of z where the last step led.
    pub(super) fn carry_jacobian(&mut self) {
        if self.prior.growth.iter().any(|growth| *growth > 0.0) {
            let factor = |j: usize| Some((j, 1.0 + self.prior.growth[j] * self.step[j]));
            self.jacobian = self.jacobian.map_columns(self.z.len(), factor);
        }
    }
}

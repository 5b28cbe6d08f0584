//! What follows from the run of a step: where the fit stands, how far a step is trusted, and whether the secant is trusted further.
//!
//! Next file to read: [`super::damped`], the step itself.

use nalgebra::DVector;

use super::{End, LeastSquares, Need};

/// Radius of trust after a rejected step, over the length of that step ...
const REJECTED: f64 = 0.25;
/// ... after one that lowered the cost by less than a quarter of what was predicted ...
const POOR: f64 = 0.5;
/// ... and, at least, after one that lowered it by more than three quarters of it.
const GOOD: f64 = 2.0;
/// Rejected steps in a row after which the fit has stalled.
const MOST_REJECTED: usize = 8;

impl LeastSquares {
    pub(super) fn accept(
        &mut self,
        z: DVector<f64>,
        e: DVector<f64>,
        cost: f64,
        ratio: f64,
        was_fresh: bool,
    ) {
        self.carry_jacobian();
        self.z = z;
        self.residual = e;
        self.cost = cost;
        self.fresh = false;
        self.measured = None;
        self.rejected = 0;
        if ratio > 0.75 {
            self.radius = self.radius.max(GOOD * self.length);
        } else if ratio < 0.25 {
            self.radius = POOR * self.length;
        }
        if self.trials_left == 0 {
            self.need = Need::Nothing(End::Limit);
        } else if ratio < 0.25 && self.thorough && !was_fresh {
            self.need = Need::Jacobian(self.z.clone());
        } else {
            self.plan();
        }
    }

    pub(super) fn reject(&mut self, was_fresh: bool) {
        self.rejected += 1;
        // Where it was the secant that failed, the radius stays as it was.
        let is_secants = self.thorough && self.measured.is_none();
        if !is_secants {
            self.radius = REJECTED * self.length;
        }
        if self.trials_left == 0 {
            self.need = Need::Nothing(End::Limit);
        } else if self.rejected > MOST_REJECTED {
            self.give_up(was_fresh);
        } else if is_secants {
            self.need = Need::Jacobian(self.z.clone());
        } else if self.rejected > 1 && self.restore() {
            // The secant did not help either. Along the measured slope, steps that are short enough lower the cost.
            self.plan();
        } else {
            // The secant update used the failed step too: the Jacobian is no longer the one measured at this point.
            self.fresh = false;
            self.plan();
        }
    }

    /// Ends because no step lowers the cost. The fall that the whole step predicts shows how far from a minimum that is.
    fn give_up(&mut self, was_fresh: bool) {
        let of_here = self.restore() || was_fresh;
        self.radius = f64::INFINITY;
        let _ = self.find_step();
        self.need = Need::Nothing(if of_here { End::Stalled } else { End::Tentative });
    }

    /// Back to the Jacobian that was measured at this point, if one was.
    fn restore(&mut self) -> bool {
        let Some(measured) = &self.measured else { return false };
        self.jacobian = measured.clone();
        self.fresh = true;
        true
    }
}

//! Gas dynamics along the burning bore of a solid rocket motor.
//!
//! Waves, the fall of pressure along the bore, faults at places: the truth against which lumped models are tried. Friction,
//! erosive burning and heat loss are not here, and the nozzle stays choked. Next files to read: `rocket_motor_1d/motor.rs`, then
//! `rocket_motor_1d/step.rs`.

mod exit;
mod faults;
mod gas;
mod layout;
mod motor;
mod quantities;
mod reconstruct;
mod steady;
mod step;

use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, SetupError, Spec};

use faults::Active;
use layout::Layout;
use motor::{Motor, Now};
use quantities::N_SHARED;
use step::Stepper;

pub use step::Balance;

/// Density ρ, velocity u, pressure p and bore radius R along a bore of area A = πR² and perimeter l = 2πR (Smelyanskiy, Luchinsky et
/// al., "Physics-based methods of failure analysis and diagnostics in human space flight", eqs. 1.27 and 1.28, without friction):
///
/// ∂(ρA)/∂t + ∂(ρuA)/∂x = ρ_p l r,  ∂(ρuA)/∂t + ∂((ρu² + p)A)/∂x = p ∂A/∂x,
///
/// ∂(eA)/∂t + ∂(u(e + p)A)/∂x = c_0²/(γ − 1) ρ_p l r,  ∂R/∂t = r = r_c (p/p_c)ⁿ,  e = p/(γ − 1) + ρu²/2.
///
/// By finite volumes of second order: linear reconstruction with van Leer's limiter, HLLC fluxes, Heun's method in steps below the
/// limit of Courant. A wall is at the head, a choked throat at the end. A hole takes choked gas of its place, a crack adds burning
/// surface, choking narrows the faces between cells.
pub struct RocketMotor1d {
    spec: Spec,
    layout: Layout,
    /// Where the parameters of the faults begin.
    first_fault: usize,
}

impl RocketMotor1d {
    /// Makes the motor of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(super) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::of(def)?))
    }

    /// The motor in the layout of a definition.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub fn of(def: &ModelDef) -> Result<Self, SetupError> {
        let layout: Layout = starlings_models_core::layout::read(def)?;
        layout.check()?;
        let first_fault = N_SHARED + layout.throat.parameters().len();
        Ok(Self { spec: quantities::spec(&layout), layout, first_fault })
    }

    fn motor(&self, theta: &[f64]) -> Motor {
        Motor::read(self.layout.cells, theta)
    }

    /// Throat and faults at a time.
    fn now(&self, t: f64, theta: &[f64], u: &[f64]) -> Now {
        let factor = self.layout.throat.factor(t, &theta[N_SHARED..], u);
        Now { factor, active: Active::at(&self.layout.faults, t, &theta[self.first_fault..]) }
    }

    /// Advances the state over one segment as [`Model::advance`] does, and says what entered and left the bore on the way.
    ///
    /// # Errors
    /// When density or pressure fall to zero somewhere, or the run takes more steps than allowed.
    pub fn advance_counting(
        &self,
        segment: Segment<'_>,
        theta: &[f64],
        x: &mut [f64],
    ) -> Result<Balance, ModelFailure> {
        let motor = self.motor(theta);
        let (mut stepper, mut balance) = (Stepper::new(motor.n_cell), Balance::default());
        self.check_inputs(&segment)?;
        let now = |t: f64| {
            let inputs = segment.u0.iter().zip(segment.slope);
            let u: Vec<f64> = inputs.map(|(u0, slope)| u0 + slope * (t - segment.t0)).collect();
            self.now(t, theta, &u)
        };
        let mut t = segment.t0;
        stepper.load(x);
        while t < segment.t1 {
            let empty = |cell| no_gas(cell, t);
            let longest = stepper.longest(&motor).map_err(empty)?;
            let next = segment.next_time(t, longest)?;
            stepper.step(&motor, [t, next - t], now, &mut balance).map_err(empty)?;
            t = next;
        }
        stepper.store(x);
        Ok(balance)
    }

    fn check_inputs(&self, segment: &Segment<'_>) -> Result<(), ModelFailure> {
        let spoiled = |(u0, slope): (&f64, &f64)| !(u0.is_finite() && slope.is_finite());
        match segment.u0.iter().zip(segment.slope).position(spoiled) {
            Some(i) => {
                let what = format!("input `{}`", self.spec.inputs[i].name);
                Err(ModelFailure::NotFinite { what, time: segment.t0 })
            }
            None => Ok(()),
        }
    }
}

fn no_gas(cell: usize, t: f64) -> ModelFailure {
    ModelFailure::Solver(format!("pressure or density fall to zero in cell {cell} at t = {t}"))
}

impl Model for RocketMotor1d {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The steady flow at the first radius of the bore and the first area of the throat.
    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let motor = self.motor(theta);
        let n = motor.n_cell;
        for (i, gas) in steady::cells(&motor).into_iter().enumerate() {
            x[i] = gas.rho;
            x[n + i] = gas.rho * gas.u;
            x[2 * n + i] = gas.energy(motor.gamma);
            x[3 * n + i] = motor.r_0;
        }
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let motor = self.motor(theta);
        let now = self.now(t, theta, u.value);
        if Stepper::new(motor.n_cell).rate(&motor, &now, x, dx).is_err() {
            dx.fill(f64::NAN);
        }
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let motor = self.motor(theta);
        let (n, now) = (motor.n_cell, self.now(t, theta, u.value));
        let (mut stepper, mut rate) = (Stepper::new(n), vec![0.0; x.len()]);
        if stepper.rate(&motor, &now, x, &mut rate).is_err() {
            return y.fill(f64::NAN);
        }
        let work = &stepper.work;
        for (y, gas) in y.iter_mut().zip(&work.cells) {
            *y = gas.p;
        }
        y[n..2 * n].copy_from_slice(&x[n..2 * n]);
        y[2 * n..3 * n].copy_from_slice(&x[3 * n..]);
        let nozzle = exit::stagnation(work.exit, motor.gamma);
        let thrust = motor.c_f * motor.throat * now.factor * nozzle;
        let scalars = [work.cells[0].p, nozzle, work.flows.nozzle[0], thrust];
        y[3 * n..3 * n + 4].copy_from_slice(&scalars);
        // Only a bore that may have a hole shows what leaves through it.
        if let Some(flow) = y.get_mut(3 * n + 4) {
            *flow = work.flows.breach[0];
        }
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        self.advance_counting(segment, theta, x).map(|_| ())
    }
}

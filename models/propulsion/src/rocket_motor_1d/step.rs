//! Steps in time: the explicit method of Heun (strong stability preserving, Shu and Osher 1988) below the limit of Courant.
//!
//! Next file to read: [`super::steady`].

use std::f64::consts::PI;

use super::motor::{Flows, Motor, Now, Work};

/// Share of a cell that the fastest wave passes in a step.
const COURANT: f64 = 0.45;

/// Mass in kg and energy in J that entered and left the bore.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// Mass of the burnt propellant.
    pub burnt: f64,
    /// Mass and energy that left through the nozzle.
    pub nozzle: [f64; 2],
    /// Mass and energy that left through a hole in the case.
    pub breach: [f64; 2],
}

impl Balance {
    fn add(&mut self, dt: f64, flows: &Flows) {
        self.burnt += dt * flows.burnt;
        for k in 0..2 {
            self.nozzle[k] += dt * flows.nozzle[k];
            self.breach[k] += dt * flows.breach[k];
        }
    }
}

/// Arrays of a step.
pub(super) struct Stepper {
    pub(super) work: Work,
    w: Vec<f64>,
    stage: Vec<f64>,
    rate: [Vec<f64>; 2],
}

impl Stepper {
    pub(super) fn new(n_cell: usize) -> Self {
        let field = || vec![0.0; 4 * n_cell];
        Self { work: Work::new(n_cell), w: field(), stage: field(), rate: [field(), field()] }
    }

    /// Takes a state: per volume as the model has it, per length here.
    pub(super) fn load(&mut self, x: &[f64]) {
        scale(x, &mut self.w, |area| area);
    }

    /// Gives the state back.
    pub(super) fn store(&self, x: &mut [f64]) {
        scale(&self.w, x, |area| 1.0 / area);
    }

    /// The longest stable step at the present state.
    ///
    /// # Errors
    /// The cell that holds no gas.
    pub(super) fn longest(&mut self, motor: &Motor) -> Result<f64, usize> {
        let n = motor.n_cell;
        let mut fastest = 0.0_f64;
        for i in 0..n {
            let [mass, momentum, energy] = [0, 1, 2].map(|k| self.w[k * n + i]);
            let u = momentum / mass;
            let square = motor.gamma * (motor.gamma - 1.0) * (energy / mass - 0.5 * u * u);
            if !(square > 0.0 && mass > 0.0 && square.is_finite()) {
                return Err(i);
            }
            fastest = fastest.max(u.abs() + square.sqrt());
        }
        Ok(COURANT * motor.dx / fastest)
    }

    /// One step from `t`.
    ///
    /// # Errors
    /// The cell that holds no gas.
    pub(super) fn step(
        &mut self,
        motor: &Motor,
        [t, dt]: [f64; 2],
        now: impl Fn(f64) -> Now,
        balance: &mut Balance,
    ) -> Result<(), usize> {
        motor.rates(&now(t), &self.w, &mut self.work, &mut self.rate[0])?;
        balance.add(0.5 * dt, &self.work.flows);
        for ((stage, w), rate) in self.stage.iter_mut().zip(&self.w).zip(&self.rate[0]) {
            *stage = w + dt * rate;
        }
        motor.rates(&now(t + dt), &self.stage, &mut self.work, &mut self.rate[1])?;
        balance.add(0.5 * dt, &self.work.flows);
        let rates = self.rate[0].iter().zip(&self.rate[1]);
        for (w, (first, second)) in self.w.iter_mut().zip(rates) {
            *w += 0.5 * dt * (first + second);
        }
        Ok(())
    }

    /// Rates of the model's state, from those per length.
    ///
    /// # Errors
    /// The cell that holds no gas.
    pub(super) fn rate(&mut self, motor: &Motor, now: &Now, x: &[f64], dx: &mut [f64]) -> Result<(), usize> {
        self.load(x);
        motor.rates(now, &self.w, &mut self.work, dx)?;
        let n = motor.n_cell;
        for i in 0..n {
            let (radius, regression) = (x[3 * n + i], dx[3 * n + i]);
            for k in 0..3 {
                let whole = dx[k * n + i] - x[k * n + i] * 2.0 * PI * radius * regression;
                dx[k * n + i] = whole / (PI * radius * radius);
            }
        }
        Ok(())
    }
}

/// Copies a state with its first three fields times a function of the bore's area.
fn scale(from: &[f64], to: &mut [f64], factor: impl Fn(f64) -> f64) {
    let n = from.len() / 4;
    to[3 * n..].copy_from_slice(&from[3 * n..]);
    for i in 0..n {
        let by = factor(PI * from[3 * n + i] * from[3 * n + i]);
        for k in 0..3 {
            to[k * n + i] = from[k * n + i] * by;
        }
    }
}

//! One time step: convection and pressure explicit, the wall's viscosity implicit.
//!
//! A pair of second order (conditions of Ascher, Ruuth & Spiteri 1997) with the abscissae 0, 1, 1: Heun's method for the
//! hyperbolic part, an L-stable diagonally implicit method with an explicit first stage for the viscous one. The step ends in
//! its last implicit stage (globally stiffly accurate; Boscarino, Pareschi & Russo 2013), so the flows at its end are those
//! for which the viscosity of the wall balances the rest. With a pair that ends in a sum of stages, such as SSP2(2,2,2), they
//! are off by a part of dt times the rest near the ends of vessels, and their derivative, the viscous pressure there, does
//! not converge. Areas have no implicit part, so each stage is a linear system. Next file to read: [`super::node`].

use super::Fault;
use super::transport::Faces;
use super::vessels::Vessels;
use super::viscous::Viscous;

/// γ = 1 − 1/√2, at which the implicit method is L-stable.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// The flows into the inlets in cm³/s over a span, linear in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inflow<'a> {
    /// Flows at the start of the span.
    pub(super) start: &'a [f64],
    /// Their slopes.
    pub(super) slope: &'a [f64],
    /// Time since that start at which a step begins.
    pub(super) since: f64,
}

impl Inflow<'_> {
    /// Writes the flows `later` than the start of the step.
    fn write(self, later: f64, flows: &mut [f64]) {
        for ((flow, start), slope) in flows.iter_mut().zip(self.start).zip(self.slope) {
            *flow = (start + slope * self.since) + slope * later;
        }
    }
}

/// Volumes in cm³ that entered at the inlets and left at the outlets during an advance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Volumes {
    /// Entered.
    pub inflow: f64,
    /// Left.
    pub outflow: f64,
}

/// What a run needs to keep between steps for speed alone.
pub(super) struct Work {
    pub(super) faces: Faces,
    pub(super) viscous: Viscous,
    stage: Vec<f64>,
    /// Flows into the inlets at the start and at the end of a step.
    inflow: [Vec<f64>; 2],
    /// Hyperbolic and viscous rates of the two stages.
    transport: [Vec<f64>; 2],
    diffusion: [Vec<f64>; 2],
}

impl Work {
    pub(super) fn new(vessels: &Vessels<'_>) -> Self {
        let zeros = || vec![0.0; vessels.n_state()];
        Self {
            faces: Faces::new(vessels),
            viscous: Viscous::new(vessels),
            stage: zeros(),
            inflow: std::array::from_fn(|_| vec![0.0; vessels.network.inlets.len()]),
            transport: [zeros(), zeros()],
            diffusion: [zeros(), zeros()],
        }
    }
}

impl Vessels<'_> {
    /// Advances the state by a step and counts what passes the ends.
    ///
    /// # Errors
    /// When a vessel has collapsed or a node allows no subcritical flow.
    pub(super) fn step(
        &self,
        dt: f64,
        inflow: Inflow<'_>,
        x: &mut [f64],
        work: &mut Work,
        volumes: &mut Volumes,
    ) -> Result<(), Fault> {
        let Work { faces, viscous, stage, inflow: flow, transport, diffusion } = work;
        inflow.write(0.0, &mut flow[0]);
        inflow.write(dt, &mut flow[1]);
        let mut count = |faces: &Faces, flow: &[f64]| {
            volumes.inflow += 0.5 * dt * flow.iter().sum::<f64>();
            let out: f64 = self.network.outlets.iter().map(|&node| self.outflow(node, faces)).sum();
            volumes.outflow += 0.5 * dt * out;
        };

        stage.copy_from_slice(x);
        self.diffuse(0.0, &flow[0], stage, viscous, &mut diffusion[0])?;
        self.transport(x, &viscous.end, &flow[0], faces, &mut transport[0])?;
        count(faces, &flow[0]);

        for (i, stage) in stage.iter_mut().enumerate() {
            *stage = x[i] + dt * (transport[0][i] + (1.0 - GAMMA) * diffusion[0][i]);
        }
        self.diffuse(GAMMA * dt, &flow[1], stage, viscous, &mut diffusion[1])?;
        self.transport(stage, &viscous.end, &flow[1], faces, &mut transport[1])?;
        count(faces, &flow[1]);

        for (i, x) in x.iter_mut().enumerate() {
            let explicit = 0.5 * (transport[0][i] + transport[1][i] + diffusion[0][i]);
            *x += dt * (explicit + (0.5 - GAMMA) * diffusion[1][i]);
        }
        self.diffuse(GAMMA * dt, &flow[1], x, viscous, &mut diffusion[0])?;
        Ok(())
    }

    /// Writes the rate of the state at one time.
    ///
    /// # Errors
    /// As [`Vessels::step`].
    pub(super) fn rate(
        &self,
        inflow: &[f64],
        x: &[f64],
        work: &mut Work,
        rate: &mut [f64],
    ) -> Result<(), Fault> {
        let Work { faces, viscous, stage, diffusion, .. } = work;
        stage.copy_from_slice(x);
        self.diffuse(0.0, inflow, stage, viscous, &mut diffusion[0])?;
        self.transport(x, &viscous.end, inflow, faces, rate)?;
        for (rate, diffusion) in rate.iter_mut().zip(&diffusion[0]) {
            *rate += diffusion;
        }
        Ok(())
    }
}

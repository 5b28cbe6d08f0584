//! The conical shell as a model: amplitudes of its modes as states, a point load as input, sensors as outputs.
//!
//! A step is exact for a load that is linear in time. Next file to read: [`super::layout`].

use std::f64::consts::PI;
use std::sync::Arc;

use starlings_models_core::cache::Cache;
use starlings_models_core::integrate::{Solver, Tolerance};
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, Quantity, Role, SetupError, Spec, layout};

use super::{Cone, Layout, Ritz, Wall};
use crate::modal::Modes;

/// Donnell's shell (Smelyanskiy, Luchinsky et al., eqs. 1.36 to 1.42, as docs/structures.md corrects them) in its own modes:
///
/// q'' + 2δ q' + ω² q = W(s_F) F/(π sin α ρh ∫ s ds),  w = Σ W(s) cos(nθ) q.
///
/// Parameters are E, ν, ρ, h and δ; an amplitude q is the root mean square of w along a crest, in m.
pub struct ConicalShell {
    spec: Spec,
    cone: Cone,
    layout: Layout,
    /// Integrals for each number of waves.
    ritz: Vec<Ritz>,
    modes: Cache<Shell>,
}

/// The modes for one wall.
struct Shell {
    modes: Modes,
    /// W where the load acts, times cos 0.
    source: Vec<f64>,
    /// W cos nθ of every mode at each sensor.
    sensors: Vec<Vec<f64>>,
}

fn wall(theta: &[f64]) -> Wall {
    Wall { young: theta[0], poisson: theta[1], density: theta[2], thickness: theta[3] }
}

fn parameters() -> Vec<Quantity> {
    vec![
        Quantity::new("E", "Pa").role(Role::Stiffness).positive().default(110e9).says("Young's modulus."),
        Quantity::new("nu", "").range(0.0, 0.49).default(0.34).says("Poisson's ratio."),
        Quantity::new("rho", "kg/m^3").role(Role::Inertia).positive().default(4500.0).says("Density."),
        Quantity::new("h", "m").positive().default(0.002).says("Thickness of the shell."),
        Quantity::new("delta", "1/s")
            .role(Role::Damping)
            .range(0.0, f64::INFINITY)
            .default(2.0)
            .says("Rate at which every mode decays."),
    ]
}

impl ConicalShell {
    /// The model in a layout.
    ///
    /// # Errors
    /// When a number of the layout is not usable.
    pub fn new(layout: &Layout) -> Result<Self, SetupError> {
        let cone = layout.check()?;
        let n = layout.waves.len() * layout.modes;
        let amplitudes = Quantity::new("amplitudes", "m")
            .size(n)
            .role(Role::Displacement)
            .says("Amplitudes of the modes, by number of waves and then by frequency.");
        let rates =
            Quantity::new("rates", "m/s").size(n).role(Role::Velocity).says("Rates of the amplitudes.");
        let displacement = Quantity::new("displacement", "m")
            .size(layout.sensors.len())
            .role(Role::Displacement)
            .says("Displacement normal to the shell at the sensors.");
        let spec = Spec {
            kind: "conical-shell".to_owned(),
            says: "A thin conical shell, clamped at its small end, struck at a point.".to_owned(),
            states: vec![amplitudes.clone(), rates],
            parameters: parameters(),
            outputs: vec![displacement, amplitudes],
            inputs: vec![Quantity::new("force", "N").role(Role::Force).says("Normal force at the source.")],
            measures: vec![("amplitudes".to_owned(), "amplitudes".to_owned())],
            restart: true,
        };
        let ritz = layout.waves.iter().map(|waves| Ritz::new(cone, *waves, layout.terms)).collect();
        Ok(Self { spec, cone, layout: layout.clone(), ritz, modes: Cache::default() })
    }

    /// The model of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&layout::read(def)?)?))
    }

    fn shell(&self, theta: &[f64]) -> Arc<Shell> {
        self.modes.get(theta, || self.solve(&wall(theta), theta[4]))
    }

    fn solve(&self, wall: &Wall, decay: f64) -> Shell {
        let Layout { waves, modes: count, in_plane_inertia, source, sensors, .. } = &self.layout;
        let n = waves.len() * count;
        let mut shell = Shell {
            modes: Modes { squares: Vec::with_capacity(n), decay },
            source: Vec::with_capacity(n),
            sensors: vec![Vec::with_capacity(n); sensors.len()],
        };
        for (ritz, waves) in self.ritz.iter().zip(waves) {
            let Some(modes) = ritz.modes(wall, *in_plane_inertia, *count) else {
                shell.modes.squares = vec![f64::NAN; n];
                shell.source = vec![f64::NAN; n];
                shell.sensors = vec![vec![f64::NAN; n]; sensors.len()];
                return shell;
            };
            for mode in &modes {
                shell.modes.squares.push(mode.square);
                shell.source.push(ritz.shape(mode, *source));
                for (values, [s, angle]) in shell.sensors.iter_mut().zip(sensors) {
                    values.push(ritz.shape(mode, *s) * (*waves as f64 * angle.to_radians()).cos());
                }
            }
        }
        shell
    }

    /// Mass that moves with an amplitude: half of the shell's, since cos² around it is a half.
    fn moving_mass(&self, wall: &Wall) -> f64 {
        PI * self.cone.half_angle.sin() * wall.density * wall.thickness * self.cone.moment()
    }
}

impl Model for ConicalShell {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// At rest.
    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let shell = self.shell(theta);
        let (q, v) = x.split_at(shell.source.len());
        let (rate, acceleration) = dx.split_at_mut(q.len());
        rate.copy_from_slice(v);
        let load = u.value[0] / self.moving_mass(&wall(theta));
        for (i, a) in acceleration.iter_mut().enumerate() {
            *a = shell.source[i] * load - 2.0 * theta[4] * v[i] - shell.modes.squares[i] * q[i];
        }
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        let shell = self.shell(theta);
        let q = &x[..shell.source.len()];
        let (displacement, amplitudes) = y.split_at_mut(shell.sensors.len());
        for (y, sensor) in displacement.iter_mut().zip(&shell.sensors) {
            *y = sensor.iter().zip(q).map(|(shape, q)| shape * q).sum();
        }
        amplitudes.copy_from_slice(q);
    }

    /// Where an effect asks for integration: amplitudes are micrometres and oscillate without being stiff.
    fn solver(&self) -> Solver {
        Solver::Dopri5(Tolerance { relative: 1e-9, absolute: 1e-15 })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let shell = self.shell(theta);
        let (q, v) = x.split_at_mut(shell.source.len());
        let mass = self.moving_mass(&wall(theta));
        let load = [segment.u0[0] / mass, segment.slope[0] / mass];
        shell.modes.advance(segment.t1 - segment.t0, &shell.source, load, q, v);
        Ok(())
    }
}

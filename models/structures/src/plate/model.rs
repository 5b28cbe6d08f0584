//! The plate as a model: amplitudes of the whole plate's modes as states, the force as input, the sensors as outputs.
//!
//! A step is exact for a force that is linear in time. Next file to read: [`super::damaged`].

use std::sync::Arc;

use nalgebra::{DVector, DVectorView};
use starlings_models_core::cache::Cache;
use starlings_models_core::integrate::{Solver, Tolerance};
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, Quantity, Role, SetupError, Spec, layout};

use super::damaged::DamagedModes;
use super::{Damage, Geometry, Layout, Material, Overlap, Patch};

/// D(1 − ε χ) Lap² w + ρh ∂²w/∂t² + 2δρh ∂w/∂t = f (Smelyanskiy, Luchinsky et al., eq. 1.64, with damping), simply supported.
///
/// Parameters are D, ρh, δ, the severity ε, the centre (x_d, y_d) and the half width d of the patch; states the amplitudes of the
/// modes and their rates; outputs the displacement at the sensors and the amplitudes, which a modal filter shows.
pub struct PlateModel {
    spec: Spec,
    geometry: Geometry,
    /// Values of the modes where the force acts.
    source: Vec<f64>,
    /// Values of the modes at each sensor.
    sensors: Vec<DVector<f64>>,
    damaged: Cache<DamagedModes>,
}

/// The parameters by name.
struct Parameters {
    material: Material,
    damage: Damage,
}

impl Parameters {
    fn read(theta: &[f64]) -> Self {
        Self {
            material: Material { stiffness: theta[0], mass: theta[1], decay: theta[2] },
            damage: Damage {
                severity: theta[3],
                patch: Patch { centre: [theta[4], theta[5]], half_width: theta[6] },
            },
        }
    }
}

fn parameters([lx, ly]: [f64; 2]) -> Vec<Quantity> {
    let centre = |name: &str, length: f64| {
        Quantity::new(name, "m").range(0.0, length).default(0.5 * length).says("Centre of the damaged patch.")
    };
    vec![
        Quantity::new("D", "N m")
            .role(Role::Stiffness)
            .positive()
            .default(164_250.0)
            .says("Flexural stiffness of the plate."),
        Quantity::new("mass", "kg/m^2").role(Role::Inertia).positive().default(12.78).says("Mass per area."),
        Quantity::new("delta", "1/s")
            .role(Role::Damping)
            .range(0.0, f64::INFINITY)
            .default(60.0)
            .says("Rate at which every mode decays."),
        Quantity::new("eps", "")
            .range(0.0, 0.99)
            .default(0.0)
            .says("Share of the stiffness lost in the patch."),
        centre("xd", lx),
        centre("yd", ly),
        Quantity::new("d", "m").positive().default(0.025).says("Half width of the square patch."),
    ]
}

impl PlateModel {
    /// The model in a layout.
    ///
    /// # Errors
    /// When a number of the layout is not usable.
    pub fn new(layout: &Layout) -> Result<Self, SetupError> {
        let geometry = layout.check()?;
        let amplitudes = Quantity::new("amplitudes", "m")
            .size(geometry.n_mode())
            .role(Role::Displacement)
            .says("Amplitudes of the modes of the whole plate.");
        let rates = Quantity::new("rates", "m/s")
            .size(geometry.n_mode())
            .role(Role::Velocity)
            .says("Rates of the amplitudes.");
        let displacement = Quantity::new("displacement", "m")
            .size(layout.sensors.len())
            .role(Role::Displacement)
            .says("Transverse displacement at the sensors.");
        let force = Quantity::new("force", "N").role(Role::Force).says("Transverse force at the source.");
        let spec = Spec {
            kind: "plate".to_owned(),
            says: "A simply supported plate that has lost stiffness in a patch, struck at a point."
                .to_owned(),
            states: vec![amplitudes.clone(), rates],
            parameters: parameters(geometry.length),
            outputs: vec![displacement, amplitudes],
            inputs: vec![force],
            measures: vec![("amplitudes".to_owned(), "amplitudes".to_owned())],
            restart: true,
        };
        let sensors = layout.sensors.iter().map(|at| DVector::from_vec(geometry.shapes(*at))).collect();
        let source = geometry.shapes(layout.source);
        Ok(Self { spec, geometry, source, sensors, damaged: Cache::default() })
    }

    /// The model of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&layout::read(def)?)?))
    }

    fn damaged(&self, theta: &[f64]) -> Arc<DamagedModes> {
        let Parameters { material, damage } = Parameters::read(theta);
        self.damaged.get(theta, || DamagedModes::new(&self.geometry, &material, &damage))
    }

    /// Acceleration of every mode by a unit force.
    fn forcing(&self, theta: &[f64]) -> DVector<f64> {
        let [lx, ly] = self.geometry.length;
        DVector::from_column_slice(&self.source) * (4.0 / (theta[1] * lx * ly))
    }
}

impl Model for PlateModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// At rest.
    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let Parameters { material, damage } = Parameters::read(theta);
        let (c, v) = x.split_at(self.geometry.n_mode());
        let (rate, acceleration) = dx.split_at_mut(c.len());
        rate.copy_from_slice(v);
        let squares = self.geometry.frequencies(&material).into_iter().map(|omega| omega * omega);
        let elastic: Vec<f64> = squares.zip(c).map(|(square, c)| square * c).collect();
        let lost = Overlap::new(self.geometry.length, self.geometry.modes, damage.patch).apply(&elastic);
        let forcing = self.forcing(theta);
        for (i, a) in acceleration.iter_mut().enumerate() {
            let force = forcing[i] * u.value[0];
            *a = force - 2.0 * material.decay * v[i] - elastic[i] + damage.severity * lost[i];
        }
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        let n = self.geometry.n_mode();
        let (displacement, amplitudes) = y.split_at_mut(self.sensors.len());
        let c = DVectorView::from_slice(&x[..n], n);
        displacement.iter_mut().zip(&self.sensors).for_each(|(y, sensor)| *y = sensor.dot(&c));
        amplitudes.copy_from_slice(&x[..n]);
    }

    /// Where an effect asks for integration: amplitudes are micrometres and oscillate without being stiff.
    fn solver(&self) -> Solver {
        Solver::Dopri5(Tolerance { relative: 1e-9, absolute: 1e-17 })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let damaged = self.damaged(theta);
        let (c, v) = x.split_at_mut(self.geometry.n_mode());
        let n = c.len();
        let mut q = &damaged.to * DVectorView::from_slice(c, n);
        let mut p = &damaged.to * DVectorView::from_slice(v, n);
        let share = &damaged.to * self.forcing(theta);
        let load = [segment.u0[0], segment.slope[0]];
        let h = segment.t1 - segment.t0;
        damaged.modes.advance(h, share.as_slice(), load, q.as_mut_slice(), p.as_mut_slice());
        c.copy_from_slice((&damaged.from * q).as_slice());
        v.copy_from_slice((&damaged.from * p).as_slice());
        Ok(())
    }
}

//! A burning bore that does not regress, and its steady flow by momentum, energy and the nozzle.

#![allow(dead_code)] // every test file uses its own part

use std::f64::consts::PI;

use serde_json::Value;

use crate::kit::Motor;

pub(crate) const C_0: f64 = 1030.0;

/// A grain that gives the gas of the default one and does not regress.
pub(crate) const FROZEN: [(&str, f64); 2] = [("r_c", 5e-12), ("rho_p", 1.75e12)];

pub(crate) fn motor(layout: Value, constants: &[(&'static str, f64)], outputs: &[&'static str]) -> Motor {
    Motor { kind: "rocket-motor-1d", layout, constants: constants.to_vec(), outputs: outputs.to_vec() }
}

pub(crate) fn near(got: f64, want: f64, relative: f64) {
    assert!((got / want - 1.0).abs() < relative, "{got} for {want}");
}

/// A frozen bore of radius 0.05 m.
pub(crate) struct Steady {
    pub(crate) gamma: f64,
    pub(crate) throat: f64,
    pub(crate) length: f64,
}

impl Steady {
    pub(crate) fn burning(p: f64) -> f64 {
        1750.0 * 0.005 * (p / 1.44e6).powf(0.4)
    }

    pub(crate) fn choked(&self) -> f64 {
        (0.5 * (self.gamma + 1.0)).powf(-0.5 * (self.gamma + 1.0) / (self.gamma - 1.0))
    }

    pub(crate) fn lumped(&self) -> f64 {
        let out = self.choked() * self.throat * self.gamma / C_0;
        (2.0 * PI * 0.05 * self.length * Self::burning(1.0) / out).powf(1.0 / 0.6)
    }

    /// Pressures at 2000 places, and what burns less what the throat passes.
    pub(crate) fn march(&self, head: f64) -> (Vec<f64>, f64) {
        let (n, g) = (2000, self.gamma);
        let heat = C_0 * C_0 / (g - 1.0);
        let (mut flux, mut p, mut u, mut rho) = (0.0, head, 0.0, g * head / (C_0 * C_0));
        let mut course = vec![];
        for _ in 0..n {
            // Of the momentum, p + g u = p_h, and the enthalpy: a quadratic for u at the middle and at the end of a step.
            let middle = 1.5 * p - 0.5 * course.len().checked_sub(2).map_or(p, |k| course[k]);
            let step = self.length / f64::from(n) * 2.0 / 0.05 * Self::burning(middle);
            flux += step;
            for _ in 0..50 {
                u = flux / rho;
                p = head - flux * u;
                rho = g / (g - 1.0) * p / (heat - 0.5 * u * u);
            }
            course.push(p);
        }
        let mach = u / (g * p / rho).sqrt();
        let rest = 1.0 + 0.5 * (g - 1.0) * mach * mach;
        let (p, rho) = (p * rest.powf(g / (g - 1.0)), rho * rest.powf(1.0 / (g - 1.0)));
        (course, flux * PI * 0.0025 - self.choked() * self.throat * (g * p * rho).sqrt())
    }
}

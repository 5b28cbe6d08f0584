//! The rates of mass, momentum, energy and radius in the cells of a bore.
//!
//! Next file to read: [`super::step`].

use std::f64::consts::PI;

use super::exit;
use super::faults::{Active, shares};
use super::gas::{Gas, hllc};
use super::reconstruct;
use crate::nozzle;

/// A motor at its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motor {
    pub(super) n_cell: usize,
    pub(super) gamma: f64,
    n: f64,
    /// Burning rate at a pressure of one.
    rate: f64,
    pub(super) p_c: f64,
    rho_p: f64,
    pub(super) c_0: f64,
    /// Area of the throat at the start.
    pub(super) throat: f64,
    pub(super) r_0: f64,
    pub(super) dx: f64,
    r_e: f64,
    pub(super) c_f: f64,
}

/// What the surroundings do at one time.
#[derive(Clone, Debug)]
pub(super) struct Now {
    /// The throat's area over the one at the start.
    pub(super) factor: f64,
    pub(super) active: Active,
}

/// Mass and energy per time that enter and leave the bore.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Flows {
    pub(super) burnt: f64,
    pub(super) nozzle: [f64; 2],
    pub(super) breach: [f64; 2],
}

/// Arrays that a rate needs, and what it finds on the way.
#[derive(Debug)]
pub(super) struct Work {
    pub(super) cells: Vec<Gas>,
    ends: Vec<[Gas; 2]>,
    flux: Vec<[f64; 3]>,
    open: Vec<f64>,
    pub(super) exit: Gas,
    pub(super) flows: Flows,
}

impl Work {
    pub(super) fn new(n_cell: usize) -> Self {
        Self {
            cells: vec![Gas::default(); n_cell],
            ends: vec![[Gas::default(); 2]; n_cell],
            flux: vec![[0.0; 3]; n_cell + 1],
            open: vec![0.0; n_cell + 1],
            exit: Gas::default(),
            flows: Flows::default(),
        }
    }
}

impl Motor {
    /// Reads the parameters of [`super::quantities`].
    pub(super) fn read(n_cell: usize, theta: &[f64]) -> Self {
        let [gamma, n, r_c, p_c, rho_p, c_0, throat, r_0, length, r_e, c_f] =
            std::array::from_fn(|i| theta[i]);
        let rate = r_c * p_c.powf(-n);
        Self { n_cell, gamma, n, rate, p_c, rho_p, c_0, throat, r_0, dx: length / n_cell as f64, r_e, c_f }
    }

    /// Mass that burns per time and area at a pressure.
    pub(super) fn burning(&self, p: f64) -> f64 {
        self.rho_p * self.rate * p.powf(self.n)
    }

    /// Rates of mass, momentum and energy per length and of the radius, field after field, of a state in the same order.
    ///
    /// # Errors
    /// The cell in which density or pressure are no positive numbers.
    pub(super) fn rates(&self, now: &Now, w: &[f64], work: &mut Work, dw: &mut [f64]) -> Result<(), usize> {
        self.read_cells(w, work)?;
        self.fluxes(now, w, work);
        let n = self.n_cell;
        work.flows = Flows::default();
        for i in 0..n {
            let (gas, radius) = (work.cells[i], w[3 * n + i]);
            let regression = if radius < self.r_e { self.rate * gas.p.max(0.0).powf(self.n) } else { 0.0 };
            let mass = 2.0 * PI * radius * self.rho_p * regression;
            let rate = |k: usize| (work.flux[i][k] - work.flux[i + 1][k]) / self.dx;
            dw[i] = rate(0) + mass;
            dw[n + i] = rate(1) + gas.p * (work.open[i + 1] - work.open[i]) / self.dx;
            dw[2 * n + i] = rate(2) + mass * self.enthalpy();
            dw[3 * n + i] = regression;
            work.flows.burnt += mass * self.dx;
        }
        work.flows.nozzle = [work.flux[n][0], work.flux[n][2]];
        self.leak_and_crack(now, work, dw);
        Ok(())
    }

    /// Enthalpy of the gas that a mass of propellant gives.
    pub(super) fn enthalpy(&self) -> f64 {
        self.c_0 * self.c_0 / (self.gamma - 1.0)
    }

    fn read_cells(&self, w: &[f64], work: &mut Work) -> Result<(), usize> {
        let n = self.n_cell;
        for (i, cell) in work.cells.iter_mut().enumerate() {
            let area = PI * w[3 * n + i] * w[3 * n + i];
            *cell = Gas::of_conserved([w[i] / area, w[n + i] / area, w[2 * n + i] / area], self.gamma);
            if !cell.is_sound() {
                return Err(i);
            }
        }
        Ok(())
    }

    /// Fluxes through the ends of all cells, and the areas that are open there.
    fn fluxes(&self, now: &Now, w: &[f64], work: &mut Work) {
        let n = self.n_cell;
        reconstruct::ends(&work.cells, &mut work.ends);
        let area = |i: usize| PI * w[3 * n + i] * w[3 * n + i];
        for face in 0..=n {
            let bore = 0.5 * (area(face.saturating_sub(1)) + area(face.min(n - 1)));
            work.open[face] = bore * now.active.open(face as f64 * self.dx);
            let through = if face == 0 {
                let first = work.ends[0][0];
                hllc(first.mirrored(), first, self.gamma)
            } else if face == n {
                let mach = exit::mach(self.throat * now.factor / work.open[n], self.gamma);
                work.exit = exit::gas(work.ends[n - 1][1], mach, self.gamma);
                work.exit.flux(self.gamma)
            } else {
                hllc(work.ends[face - 1][1], work.ends[face][0], self.gamma)
            };
            work.flux[face] = through.map(|f| f * work.open[face]);
        }
    }

    /// Gas that leaves through a hole, choked at the cell's pressure, and gas that a crack adds.
    fn leak_and_crack(&self, now: &Now, work: &mut Work, dw: &mut [f64]) {
        let n = self.n_cell;
        if let Some((x, area)) = now.active.breach {
            for (i, share) in shares(x, self.dx, n) {
                let Gas { rho, u, p } = work.cells[i];
                let mass = nozzle::choked(self.gamma) * share * area * (self.gamma * p * rho).sqrt();
                let heat = self.gamma / (self.gamma - 1.0) * p / rho + 0.5 * u * u;
                dw[i] -= mass / self.dx;
                dw[n + i] -= mass * u / self.dx;
                dw[2 * n + i] -= mass * heat / self.dx;
                work.flows.breach[0] += mass;
                work.flows.breach[1] += mass * heat;
            }
        }
        if let Some((x, area)) = now.active.crack {
            for (i, share) in shares(x, self.dx, n) {
                let mass = share * area * self.burning(work.cells[i].p);
                dw[i] += mass / self.dx;
                dw[2 * n + i] += mass * self.enthalpy() / self.dx;
                work.flows.burnt += mass;
            }
        }
    }
}

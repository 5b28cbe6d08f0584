//! The scheme of openBF (Melis 2017), on grids as fine as one likes: in the cells of the files it gives openBF's digits, and in finer
//! ones it comes to `artery-1d`. What lies between the two programs is the grid of openBF.
//!
//! Linear reconstruction with superbee slopes, a centred flux with the dissipation of Lax and Friedrichs, two stages of Heun, friction after
//! them. Before each step the flow of the inlet is set in the first cell, the pressure of a Windkessel in the last, and what a
//! junction asks for in the cells that meet there: of first order.

use std::f64::consts::PI;

use super::{PLACES, Table, at};

/// Density and viscosity of the blood in the files, in SI units as all here.
const RHO: f64 = 1060.0;
const MU: f64 = 4e-3;
/// One less the square of Poisson's ratio.
const PLANE: f64 = 0.75;

/// A vessel of a file.
pub(super) struct Given {
    /// Beginning of the name of its results.
    pub(super) name: &'static str,
    /// Young's modulus, radius, thickness of the wall, length, and the exponent ζ of the velocity profile.
    pub(super) wall: [f64; 5],
    /// First cell and number of cells in the study, and the number of openBF's: of 1 mm.
    pub(super) cells: [usize; 3],
    /// Resistances before and behind the compliance of its Windkessel, and that; without one the others begin where it ends.
    pub(super) outlet: Option<[f64; 3]>,
}

struct Vessel {
    /// p = β (√(A/A0) − 1), and γ A^(3/2) is the pressure's part of the momentum flux.
    beta: f64,
    gamma: f64,
    rest: f64,
    friction: f64,
    width: f64,
    area: Vec<f64>,
    flow: Vec<f64>,
    /// Area and flow after the last step in the first and in the last cell, which stand beside them in the next.
    ghosts: [[f64; 2]; 2],
    outlet: Option<[f64; 3]>,
    /// Pressure in the compliance of the Windkessel.
    stored: f64,
}

fn superbee(a: f64, b: f64) -> f64 {
    if a * b <= 0.0 {
        return 0.0;
    }
    let (x, y) = (a.abs(), b.abs());
    a.signum() * x.min(2.0 * y).max((2.0 * x).min(y))
}

/// Half of the limited difference across each cell.
fn slopes(values: &[f64]) -> Vec<f64> {
    let difference = |i: usize| if i == 0 || i == values.len() { 0.0 } else { values[i] - values[i - 1] };
    (0..values.len()).map(|i| 0.5 * superbee(difference(i), difference(i + 1))).collect()
}

impl Vessel {
    fn new(given: &Given, finer: usize) -> Self {
        let ([young, radius, thickness, length, profile], n) = (given.wall, given.cells[2] * finer);
        let (beta, rest) = (young * thickness / (PLANE * radius), PI * radius * radius);
        let (area, flow, ghosts) = (vec![rest; n], vec![0.0; n], [[rest, 0.0]; 2]);
        let (gamma, width) = (beta / (3.0 * RHO * rest.sqrt()), length / n as f64);
        let friction = 2.0 * (profile + 2.0) * PI * MU / RHO;
        Self { beta, gamma, rest, friction, width, area, flow, ghosts, outlet: given.outlet, stored: 0.0 }
    }

    fn pressure(&self, area: f64) -> f64 {
        self.beta * ((area / self.rest).sqrt() - 1.0)
    }

    fn speed(&self, area: f64) -> f64 {
        (1.5 * self.gamma * area.sqrt()).sqrt()
    }

    fn step(&self) -> f64 {
        let fastest = self.area.iter().zip(&self.flow).map(|(a, q)| (q / a + self.speed(*a)).abs());
        0.9 * self.width / fastest.fold(0.0, f64::max)
    }

    /// Fluxes of area and flow between cells, with the speed of one cell per step.
    fn fluxes(&self, area: &[f64], flow: &[f64], speed: f64) -> Vec<[f64; 2]> {
        let (a, q) = (slopes(area), slopes(flow));
        let momentum = |area: f64, flow: f64| flow * flow / area + self.gamma * area * area.sqrt();
        let between = |i: usize| {
            let (al, ql) = (area[i] + a[i], flow[i] + q[i]);
            let (ar, qr) = (area[i + 1] - a[i + 1], flow[i + 1] - q[i + 1]);
            let mass = 0.5 * (qr + ql - speed * (ar - al));
            [mass, 0.5 * (momentum(ar, qr) + momentum(al, ql) - speed * (qr - ql))]
        };
        (0..area.len() - 1).map(between).collect()
    }

    fn inside(&mut self, dt: f64) {
        let (n, speed) = (self.area.len(), self.width / dt);
        let [before, after] = self.ghosts;
        let beside = |own: &[f64], i: usize| [&[before[i]], own, &[after[i]]].concat();
        let (mut area, mut flow) = (beside(&self.area, 0), beside(&self.flow, 1));
        let flux = self.fluxes(&area, &flow, speed);
        for i in 1..=n {
            area[i] += (flux[i - 1][0] - flux[i][0]) / speed;
            flow[i] += (flux[i - 1][1] - flux[i][1]) / speed;
        }
        for values in [&mut area, &mut flow] {
            (values[0], values[n + 1]) = (values[1], values[n]);
        }
        let flux = self.fluxes(&area, &flow, speed);
        for i in 0..n {
            self.area[i] = 0.5 * (self.area[i] + area[i + 1] + (flux[i][0] - flux[i + 1][0]) / speed);
            self.flow[i] = 0.5 * (self.flow[i] + flow[i + 1] + (flux[i][1] - flux[i + 1][1]) / speed);
            self.flow[i] -= self.friction * self.flow[i] / self.area[i] * dt;
        }
        self.ghosts = [0, n - 1].map(|cell| [self.area[cell], self.flow[cell]]);
    }

    /// The last cell takes the area at which the Windkessel and the characteristic variable u + 4c agree.
    fn outlet(&mut self, dt: f64) {
        let Some([proximal, distal, compliance]) = self.outlet else { return };
        let last = self.area.len() - 1;
        let (sent, flow) = (self.area[last], self.flow[last]);
        self.stored += dt / compliance * (flow - self.stored / distal);
        let residual = |area: f64| {
            let velocity = flow / sent + 4.0 * (self.speed(sent) - self.speed(area));
            proximal * area * velocity - self.pressure(area) + self.stored
        };
        let mut area = sent;
        for _ in 0..5 {
            let h = 1e-6 * area;
            area -= residual(area) * 2.0 * h / (residual(area + h) - residual(area - h));
        }
        self.area[last] = area;
    }

    /// What an end with this area that sends this area and velocity towards the node has there: pressure, or total pressure, and flow
    /// into the node, and their derivatives.
    fn met(&self, area: f64, [sent, velocity]: [f64; 2], total: bool) -> [f64; 4] {
        let c = self.speed(area);
        let (v, part) = (velocity + 4.0 * (self.speed(sent) - c), if total { RHO } else { 0.0 });
        let pressure = self.pressure(area) + 0.5 * part * v * v;
        [pressure, area * v, (RHO * c - part * v) * c / area, v - c]
    }
}

/// The last cell of the first vessel and the first cells of the others take the state in which mass is kept, the pressure is one,
/// and the characteristic variables are what the vessels send.
fn join(vessels: &mut [Vessel], total: bool) {
    let ends: Vec<(usize, f64)> = (0..vessels.len())
        .map(|i| if i == 0 { (vessels[0].area.len() - 1, 1.0) } else { (0, -1.0) })
        .collect();
    let sent = |(vessel, (cell, sign)): (&Vessel, &(usize, f64))| {
        [vessel.area[*cell], sign * vessel.flow[*cell] / vessel.area[*cell]]
    };
    let sent: Vec<[f64; 2]> = vessels.iter().zip(&ends).map(sent).collect();
    let mut areas: Vec<f64> = sent.iter().map(|sent| sent[0]).collect();
    for _ in 0..5 {
        let met: Vec<_> = (0..ends.len()).map(|i| vessels[i].met(areas[i], sent[i], total)).collect();
        // Newton: of the linear system the pressure of the node is left.
        let sum = |of: fn(&[f64; 4]) -> f64| met.iter().map(of).sum::<f64>();
        let node = sum(|[p, q, dp, dq]| dq / dp * p - q) / sum(|[_, _, dp, dq]| dq / dp);
        for (area, [p, _, dp, _]) in areas.iter_mut().zip(&met) {
            *area += (node - p) / dp;
        }
    }
    for (i, (cell, sign)) in ends.into_iter().enumerate() {
        vessels[i].flow[cell] = sign * vessels[i].met(areas[i], sent[i], total)[1];
        vessels[i].area[cell] = areas[i];
    }
}

/// Time, pressures in Pa and flows in m³/s at the places of openBF's results, about a hundred times in the period after so many from
/// rest, with cells of 1 mm cut into so many; at the junction the total pressure is one, or the pressure.
pub(super) fn melis(given: &[Given], inflow: &Table, before: f64, finer: usize, total: bool) -> Table {
    let mut vessels: Vec<Vessel> = given.iter().map(|given| Vessel::new(given, finer)).collect();
    let (mut t, mut shown) = (0.0, Table::from([("time".to_owned(), Vec::new())]));
    let period = inflow["time"].last().copied().unwrap();
    while t < (before + 1.01) * period {
        let since = t - before * period;
        let dt = vessels.iter().map(Vessel::step).fold(f64::MAX, f64::min);
        // Of the first cell the program solves for the area that goes with the flow and its velocity, which is the area that it has.
        vessels[0].flow[0] = at(inflow, "flow", t.rem_euclid(period));
        if vessels[0].outlet.is_none() {
            join(&mut vessels, total);
        }
        for vessel in &mut vessels {
            vessel.outlet(dt);
            vessel.inside(dt);
        }
        t += dt;
        if since < shown["time"].len() as f64 * period / 99.0 {
            continue;
        }
        let mut add = |name: String, value: f64| shown.entry(name).or_default().push(value);
        add("time".to_owned(), since);
        for (vessel, given) in vessels.iter().zip(given) {
            for (place, part) in PLACES {
                // The middle of a cell of 1 mm: of one of its cells, or between two.
                let middle = (given.cells[2] as f64 * part).round_ties_even() - 0.5;
                let (cell, rest) = (middle * finer as f64 - 0.5, (middle * finer as f64 - 0.5).fract());
                let values = |values: &[f64]| {
                    (1.0 - rest).mul_add(values[cell as usize], rest * values[cell as usize + 1])
                };
                add(format!("{}_P_{place}", given.name), vessel.pressure(values(&vessel.area)));
                add(format!("{}_Q_{place}", given.name), values(&vessel.flow));
            }
        }
    }
    shown
}

//! The scheme of openBF for one vessel (Melis 2017), on grids as fine as one likes: where its results differ from `artery-1d`'s, it is
//! by its own grid.
//!
//! Linear reconstruction with superbee slopes, a centred flux with the dissipation of Lax and Friedrichs, two stages of Heun, friction after them.
//! The flow of the inlet is set in the first cell, and the pressure of the Windkessel in the last: of first order.

use std::f64::consts::PI;

use super::{PLACES, Table, TempDir, along, at, file, import, predicted, table};

/// Density and viscosity of the blood in `cca.yaml`, and its vessel, in SI units.
const RHO: f64 = 1060.0;
const MU: f64 = 4e-3;
const LENGTH: f64 = 0.126;
const RADIUS: f64 = 2.6485e-3;
const STIFFNESS: f64 = 700e3 * 0.24e-3 / 0.75;
const PROXIMAL: f64 = 2.4875e8;
const DISTAL: f64 = 1.8697e9;
const COMPLIANCE: f64 = 1.7529e-10;
/// Cells of 1 mm.
const CELLS: usize = 126;
/// The cells that the program shows, round(M/4), round(M/2) and round(3M/4).
const SHOWN: [usize; 3] = [32, 63, 94];

struct Carotid {
    width: f64,
    area: Vec<f64>,
    flow: Vec<f64>,
    /// Area and flow of the last step in the first and in the last cell, which stand beside them in the next.
    ghosts: [[f64; 2]; 2],
    /// Pressure in the Windkessel.
    stored: f64,
}

/// p = β (√(A/A0) − 1) and the pressure's part of the momentum flux, γ A^(3/2).
fn walls() -> (f64, f64) {
    let beta = STIFFNESS / RADIUS;
    (beta, beta / (3.0 * RHO * RADIUS * PI.sqrt()))
}

fn pressure(area: f64) -> f64 {
    walls().0 * (area.sqrt() / (PI.sqrt() * RADIUS) - 1.0)
}

fn speed(area: f64) -> f64 {
    (1.5 * walls().1 * area.sqrt()).sqrt()
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

/// Fluxes of area and flow between cells, with the speed of one cell per step.
fn fluxes(area: &[f64], flow: &[f64], speed: f64) -> Vec<[f64; 2]> {
    let (a, q) = (slopes(area), slopes(flow));
    let momentum = |area: f64, flow: f64| flow * flow / area + walls().1 * area * area.sqrt();
    let between = |i: usize| {
        let (al, ql) = (area[i] + a[i], flow[i] + q[i]);
        let (ar, qr) = (area[i + 1] - a[i + 1], flow[i + 1] - q[i + 1]);
        [0.5 * (qr + ql - speed * (ar - al)), 0.5 * (momentum(ar, qr) + momentum(al, ql) - speed * (qr - ql))]
    };
    (0..area.len() - 1).map(between).collect()
}

impl Carotid {
    fn new(finer: usize) -> Self {
        let (n, rest) = (CELLS * finer, PI * RADIUS * RADIUS);
        let width = LENGTH / n as f64;
        Self { width, area: vec![rest; n], flow: vec![0.0; n], ghosts: [[rest, 0.0]; 2], stored: 0.0 }
    }

    fn step(&self) -> f64 {
        let fastest = self.area.iter().zip(&self.flow).map(|(a, q)| (q / a + speed(*a)).abs());
        0.9 * self.width / fastest.fold(0.0, f64::max)
    }

    fn inside(&mut self, dt: f64) {
        let (n, speed) = (self.area.len(), self.width / dt);
        let [before, after] = self.ghosts;
        let beside = |own: &[f64], i: usize| [&[before[i]], own, &[after[i]]].concat();
        let (mut area, mut flow) = (beside(&self.area, 0), beside(&self.flow, 1));
        let flux = fluxes(&area, &flow, speed);
        for i in 1..=n {
            area[i] += (flux[i - 1][0] - flux[i][0]) / speed;
            flow[i] += (flux[i - 1][1] - flux[i][1]) / speed;
        }
        for values in [&mut area, &mut flow] {
            (values[0], values[n + 1]) = (values[1], values[n]);
        }
        let flux = fluxes(&area, &flow, speed);
        for i in 0..n {
            self.area[i] = 0.5 * (self.area[i] + area[i + 1] + (flux[i][0] - flux[i + 1][0]) / speed);
            self.flow[i] = 0.5 * (self.flow[i] + flow[i + 1] + (flux[i][1] - flux[i + 1][1]) / speed);
            self.flow[i] -= 8.0 * PI * MU / RHO * self.flow[i] / self.area[i] * dt;
        }
    }

    /// The last cell takes the area at which the Windkessel and the characteristic variable u + 4c agree.
    fn outlet(&mut self, dt: f64) {
        let last = self.area.len() - 1;
        let (sent, flow) = (self.area[last], self.flow[last]);
        self.stored += dt / COMPLIANCE * (flow - self.stored / DISTAL);
        let residual = |area: f64| {
            let velocity = flow / sent + 4.0 * (speed(sent) - speed(area));
            PROXIMAL * area * velocity - pressure(area) + self.stored
        };
        let mut area = sent;
        for _ in 0..10 {
            let h = 1e-6 * area;
            area -= residual(area) * 2.0 * h / (residual(area + h) - residual(area - h));
        }
        self.area[last] = area;
    }
}

/// Time within the period, pressures in Pa and flows in m³/s at [`SHOWN`] over the fourth period from rest, about a hundred
/// times, with cells of 1 mm cut into so many.
fn carotid(finer: usize, inflow: &Table) -> Table {
    let (mut vessel, mut t) = (Carotid::new(finer), 0.0);
    let period = inflow["time"].last().copied().unwrap();
    let mut shown: Vec<Vec<f64>> = vec![Vec::new(); 7];
    while t < 4.01 * period {
        let dt = vessel.step();
        // Of the first cell the program solves for the area that goes with the flow and its velocity, which is the area that it has.
        vessel.flow[0] = at(inflow, "flow", t.rem_euclid(period));
        vessel.inside(dt);
        vessel.outlet(dt);
        let last = vessel.area.len() - 1;
        vessel.ghosts = [0, last].map(|cell| [vessel.area[cell], vessel.flow[cell]]);
        let since = t - 3.0 * period;
        if since >= shown[0].len() as f64 * period / 99.0 {
            shown[0].push(since);
            for (i, cell) in SHOWN.iter().enumerate() {
                // The middle of a cell of 1 mm: of one of its cells, or between two.
                let place = (*cell as f64 - 0.5) * finer as f64 - 0.5;
                let (cell, part) = (place.floor() as usize, place.fract());
                let next = (cell + 1).min(last);
                let between = |values: &[f64]| (1.0 - part).mul_add(values[cell], part * values[next]);
                shown[1 + i].push(pressure(between(&vessel.area)));
                shown[4 + i].push(between(&vessel.flow));
            }
        }
        t += dt;
    }
    let names = ["time", "P_quarter", "P_mid", "P_threequarter", "Q_quarter", "Q_mid", "Q_threequarter"];
    names.into_iter().map(str::to_owned).zip(shown).collect()
}

#[test]
fn what_lies_between_openbf_and_the_model_is_the_grid_of_openbf() {
    let folder = TempDir::new().unwrap();
    let cca = folder.path().join("cca");
    import(&file("openbf/cca.yaml"), &cca);
    let found = predicted(&cca);
    let text = std::fs::read_to_string(file("openbf/cca_inlet.dat")).unwrap();
    let inflow = table(&format!("time,flow\n{}", text.replace(' ', ",")));
    let grids = [1, 2, 4].map(|finer| carotid(finer, &inflow));
    let theirs = table(&std::fs::read_to_string(file("openbf/cca_reference.csv")).unwrap());
    let rms = |name: &str, other: &dyn Fn(usize, f64) -> f64| {
        let size = theirs[name].iter().fold(0.0, |size: f64, v| size.max(v.abs()));
        let times = theirs["time"].iter().map(|t| t.rem_euclid(1.1)).enumerate();
        (times.map(|(i, t)| other(i, t).powi(2)).sum::<f64>() / theirs["time"].len() as f64).sqrt() / size
    };
    for (field, letter, unit, alike) in [("pressure", "P", 0.1, 2.5e-4), ("flow_rate", "Q", 1e-6, 6e-4)] {
        for (place, part) in PLACES {
            let values = along(&found, field, [0, 51, 126], part).iter().map(|v| unit * v).collect();
            let own = Table::from([("time".to_owned(), found["time"].clone()), ("v".to_owned(), values)]);
            let name = format!("{letter}_{place}");
            let same = rms(&name, &|i, t| at(&grids[0], &name, t) - theirs[&name][i]);
            // The same scheme, but for where its steps fall.
            assert!(same < alike, "{name}: the scheme is off openBF by {same}");
            let [coarse, fine] =
                [1, 2].map(|k| rms(&name, &|_, t| at(&grids[k], &name, t) - at(&own, "v", t)));
            assert!(
                fine < 5e-4 && coarse < 9.5e-4 && coarse / fine > 1.8,
                "{name}: {coarse} with half of 1 mm, {fine} with a quarter"
            );
            let limit = |t: f64| 2.0 * at(&grids[2], &name, t) - at(&grids[1], &name, t);
            let off = rms(&name, &|_, t| limit(t) - at(&own, "v", t));
            // Of first order: what is left of the straight line to a grid without width.
            assert!(off < 5e-5, "{name}: {off} off the limit");
        }
    }
}

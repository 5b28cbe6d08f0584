//! An operating region: bounds on one signal or on two, and the search for the one that holds most of the misfit.
//!
//! Next file to read: [`super::places`].

use super::scan::scan;
use super::signal::{Kind, Signal};
use crate::number::readable;

/// Bins per signal of two signals together.
const GRID: usize = 8;
/// Factor by which two signals must do better than one.
const SECOND_SIGNAL: f64 = 1.15;
/// Factor by which the time must do better than a signal of the model, which is preferred as the more informative one.
const TIME: f64 = 1.02;

/// An interval of one signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    /// Index of the signal.
    pub(super) signal: usize,
    /// Lower end, not included; −∞ when open.
    pub(super) from: f64,
    /// Upper end, not included; +∞ when open.
    pub(super) to: f64,
}

/// Bounds that hold together.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Region {
    pub(super) bounds: Vec<Bound>,
    /// Log-likelihood ratio against no region.
    pub(super) gain: f64,
}

impl Region {
    pub(super) fn holds(&self, signals: &[Signal], i: usize) -> bool {
        self.bounds.iter().all(|b| {
            let x = signals[b.signal].values[i];
            x.is_finite() && b.from < x && x < b.to
        })
    }
}

/// How much of the misfit above the expected a region holds beyond its share of the values; negative when less.
fn concentration(region: &Region, signals: &[Signal], e: &[f64], open: &[bool]) -> f64 {
    let (mut n, mut inside, mut excess, mut excess_inside) = (0.0, 0.0, 0.0, 0.0);
    for (i, e) in e.iter().enumerate().filter(|(i, _)| open[*i]) {
        let more = e * e - 1.0;
        n += 1.0;
        excess += more;
        if region.holds(signals, i) {
            inside += 1.0;
            excess_inside += more;
        }
    }
    if excess > 0.0 { (excess_inside / excess).min(1.0) - inside / n } else { -1.0 }
}

/// The region that holds most of the misfit for its size, with readable bounds.
pub(super) fn best(signals: &[Signal], e: &[f64], open: &[bool]) -> Option<(Region, f64)> {
    let mut ranked: Vec<(Region, f64)> = Vec::new();
    for (index, signal) in signals.iter().enumerate() {
        let Some(found) = scan(&signal.values, e, open) else { continue };
        let bound = Bound {
            signal: index,
            from: readable(found.from, signal.range),
            to: readable(found.to, signal.range),
        };
        let region = Region { bounds: vec![bound], gain: found.gain };
        let concentration = concentration(&region, signals, e, open);
        ranked.push((region, concentration));
    }
    let worth = |(region, concentration): &(Region, f64)| {
        let time = region
            .bounds
            .iter()
            .any(|b| matches!(signals[b.signal].kind, Kind::Time | Kind::RecordTime { .. }));
        region.gain * concentration / if time { TIME } else { 1.0 }
    };
    ranked.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let corner = corner(signals, e, open, &ranked);
    let first = ranked.into_iter().next()?;
    Some(match corner {
        Some(corner) if worth(&corner) > SECOND_SIGNAL * worth(&first) => corner,
        _ => first,
    })
}

/// The best corner of the two tracks that did best alone.
fn corner(signals: &[Signal], e: &[f64], open: &[bool], ranked: &[(Region, f64)]) -> Option<(Region, f64)> {
    let mut tracks =
        ranked.iter().map(|(region, _)| region.bounds[0].signal).filter(|s| signals[*s].kind == Kind::Track);
    let (a, b) = (tracks.next()?, tracks.next()?);
    let table = Table::new(&signals[a].values, &signals[b].values, e, open)?;
    let (gain, x, y) = table.best()?;
    let bound = |signal: usize, [from, to]: [f64; 2]| Bound {
        signal,
        from: readable(from, signals[signal].range),
        to: readable(to, signals[signal].range),
    };
    let region = Region { bounds: vec![bound(a, x), bound(b, y)], gain };
    let concentration = concentration(&region, signals, e, open);
    Some((region, concentration))
}

/// Counts and sums of squares over the quantile bins of two signals.
struct Table {
    edges: [Vec<f64>; 2],
    n: Vec<f64>,
    ee: Vec<f64>,
}

impl Table {
    fn new(x: &[f64], y: &[f64], e: &[f64], open: &[bool]) -> Option<Self> {
        let inside: Vec<usize> =
            (0..e.len()).filter(|i| open[*i] && x[*i].is_finite() && y[*i].is_finite()).collect();
        if inside.len() < 16 * GRID {
            return None;
        }
        let edges = [x, y].map(|values| {
            let mut sorted: Vec<f64> = inside.iter().map(|i| values[*i]).collect();
            sorted.sort_by(f64::total_cmp);
            (1..GRID).map(|k| sorted[k * sorted.len() / GRID]).collect::<Vec<f64>>()
        });
        let mut table = Self { edges, n: vec![0.0; GRID * GRID], ee: vec![0.0; GRID * GRID] };
        for i in inside {
            let at = |edges: &[f64], v: f64| edges.partition_point(|edge| *edge <= v);
            let bin = at(&table.edges[1], y[i]) * GRID + at(&table.edges[0], x[i]);
            table.n[bin] += 1.0;
            table.ee[bin] += e[i] * e[i];
        }
        Some(table)
    }

    /// The corner with the largest gain of a variance of its own: (gain, interval of x, interval of y).
    fn best(&self) -> Option<(f64, [f64; 2], [f64; 2])> {
        let (n, ee): (f64, f64) = (self.n.iter().sum(), self.ee.iter().sum());
        let log = |sum: f64, n: f64| n * (sum / n).max(1.0).ln();
        let sides = || (1..GRID).flat_map(|k| [0..k, k..GRID]);
        let mut best = None;
        let mut most = 0.0;
        for x in sides() {
            for y in sides() {
                let bins = || y.clone().flat_map(|j| x.clone().map(move |i| j * GRID + i));
                let (n_in, s_in) = bins().fold((0.0, 0.0), |(n, s), b| (n + self.n[b], s + self.ee[b]));
                let (n_out, s_out) = (n - n_in, ee - s_in);
                if n_in < 16.0 || n_out < 16.0 || s_in * n_out <= s_out * n_in {
                    continue;
                }
                let gain = 0.5 * (log(ee, n) - log(s_in, n_in) - log(s_out, n_out));
                if gain > most {
                    most = gain;
                    best = Some((gain, self.interval(0, &x), self.interval(1, &y)));
                }
            }
        }
        best
    }

    fn interval(&self, axis: usize, bins: &std::ops::Range<usize>) -> [f64; 2] {
        let edges = &self.edges[axis];
        [
            if bins.start == 0 { f64::NEG_INFINITY } else { edges[bins.start - 1] },
            if bins.end == GRID { f64::INFINITY } else { edges[bins.end - 1] },
        ]
    }
}

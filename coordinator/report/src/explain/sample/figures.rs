//! What the figures of that page show.

use starlings_explain::locate::{ChannelGap, Correlated, Located, RegionMap, ResidualSpectrum, UnknownInput};
use starlings_explain::{Curve, Figures};

fn flow(t: f64) -> f64 {
    (90.0 * (2.0 * std::f64::consts::PI * t / 0.52).sin()).max(0.0)
}

/// Deterministic noise of about 2, no generator needed.
fn noise(t: f64) -> f64 {
    2.0 * ((913.0 * t).sin() + 0.8 * (2_711.0 * t).cos())
}

pub(super) fn figures(records: usize, n: usize) -> Figures {
    let time: Vec<f64> = (0..n).map(|k| 4.2 * k as f64 / n as f64).collect();
    let of = |value: fn(f64) -> f64| -> Vec<f64> { time.iter().map(|t| value(*t)).collect() };
    let curve = |k: usize| Curve {
        record: format!("in-vivo-{k}"),
        channel: "pressure".into(),
        unit: "mmHg".into(),
        noise: 2.0,
        held_out: false,
        train: Some([0.0, 2.3]),
        time: time.clone(),
        observed: of(|t| 90.0 + 12.0 * (1.3 * t).sin() + 0.094 * flow(t) + noise(t)),
        before: of(|t| 93.0 + 12.0 * (1.3 * t).sin()),
        after: of(|t| 90.0 + 12.0 * (1.3 * t).sin() + 0.094 * flow(t)),
    };
    let maps = |share: f64| vec![map(share, false), map(share, true)];
    Figures {
        time_unit: "s".into(),
        curves: (1..=records).map(curve).collect(),
        before: Located {
            places: Vec::new(),
            channels: (1..=records).map(channel).collect(),
            maps: maps(1.0),
            correlations: correlations(),
            spectra: vec![spectrum()],
            forces: vec![force(&time)],
        },
        maps_after: maps(0.05),
        null_gains: (0..100).map(|k| 4.0 * (1.7 * f64::from(k)).sin().powi(2)).collect(),
        decoy_gains: (0..20).map(|k| 7.0 * (2.3 * f64::from(k)).sin().powi(2)).collect(),
        best_gain: 4100.0,
    }
}

fn channel(k: usize) -> ChannelGap {
    ChannelGap {
        record: format!("in-vivo-{k}"),
        channel: "pressure".into(),
        unit: "mmHg".into(),
        usage: "train".into(),
        n: 462,
        noise: 2.0,
        rmse: 9.43,
        interval95: [8.7, 10.2],
        bias: 3.1,
        lag1: 0.97,
        whiteness_p: 1e-12,
        effective_n: 21.0,
    }
}

fn map(share: f64, two: bool) -> RegionMap {
    let (n_x, n_y) = (8, if two { 5 } else { 1 });
    let bias = |k: usize| share * (2.0 * (k % n_x) as f64 - 3.0 + 0.3 * (k / n_x) as f64);
    let signal = |name: &str, unit: &str| (name.to_owned(), unit.to_owned());
    RegionMap {
        channel: "pressure".into(),
        unit: "mmHg".into(),
        noise: 2.0,
        x: signal("flow", "mL/s"),
        y: two.then(|| signal("p", "mmHg")),
        x_edges: (0..=n_x).map(|k| 12.0 * k as f64).collect(),
        y_edges: if two { (0..=n_y).map(|k| 70.0 + 10.0 * k as f64).collect() } else { Vec::new() },
        count: (0..n_x * n_y).map(|k| if k == 3 { 0 } else { 20 }).collect(),
        bias: (0..n_x * n_y).map(|k| (k != 3).then(|| bias(k))).collect(),
        rmse: (0..n_x * n_y).map(|k| (k != 3).then(|| bias(k).hypot(2.0))).collect(),
        explained: 0.78,
    }
}

fn correlations() -> Vec<Correlated> {
    let row = |with: &str, coefficient: f64| Correlated {
        channel: "pressure".into(),
        with: with.into(),
        coefficient,
        interval95: [coefficient - 0.08, (coefficient + 0.06).min(1.0)],
    };
    vec![row("flow", 0.77), row("rate of flow", -0.31)]
}

fn spectrum() -> ResidualSpectrum {
    let frequency: Vec<f64> = (0..60).map(|k| 0.5 * f64::from(k)).collect();
    let power = |f: &f64| 1.0 + 40.0 * (-(f - 2.0).powi(2)).exp();
    ResidualSpectrum {
        record: "in-vivo-1".into(),
        channel: "pressure".into(),
        power_over_noise: frequency.iter().map(power).collect(),
        frequency,
        peak: 2.0,
    }
}

fn force(time: &[f64]) -> UnknownInput {
    UnknownInput {
        state: "p".into(),
        unit: "mmHg/s".into(),
        record: "in-vivo-1".into(),
        time: time.to_vec(),
        value: time.iter().map(|t| 3.0 * (1.3 * t).cos().signum() + 0.2 * noise(*t)).collect(),
        sd: vec![0.7; time.len()],
        at: time.iter().map(|t| 90.0 + 12.0 * (1.3 * t).sin()).collect(),
        states: Vec::new(),
        log_likelihood_gain: 310.0,
        proposed: time.iter().map(|t| 3.0 * (1.3 * t).cos().signum()).collect(),
    }
}

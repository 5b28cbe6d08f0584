//! Invented data of a run, for the tests of the report: a decaying, beating pressure and three parameters.

use super::data::{
    Autocorrelation, ChannelPlot, FleetEvent, FleetTable, NisSeries, ParameterRow, PassTrack, ReportData,
    RunTimeBin, RunTimes, Track, WorkerRow,
};

/// A run over `n` times of one record, with two passes, a missing stretch and an imperfect model.
pub(super) fn run(n: usize) -> ReportData {
    ReportData {
        study: "pig-aorta".into(),
        model: "windkessel-3".into(),
        says: Some("Resistance, compliance and impedance of a pig's aorta, in vivo.".into()),
        estimator: "roukf, simplex points, 2 passes".into(),
        seed: 1,
        time_unit: "s".into(),
        started: Some("2026-03-02 14:05:31 UTC".into()),
        wall_s: 3.42,
        warnings: vec![
            "NIS is 5.1 per observation: the model does not explain the data at a noise of 2 mmHg.".into(),
        ],
        parameters: parameters(),
        correlation: vec![vec![1.0, -0.31, 0.08], vec![-0.31, 1.0, 0.77], vec![0.08, 0.77, 1.0]],
        tracks: parameters().iter().map(|row| track(row, n)).collect(),
        x_label: "time [s]".into(),
        channels: vec![channel(n)],
        autocorrelation: vec![Autocorrelation {
            record: "in-vivo-1".into(),
            channel: "pressure".into(),
            lag_time: (0..60).map(|k| 0.005 * f64::from(k)).collect(),
            value: (0..60).map(|k| (0.11 * f64::from(k)).cos() * (-0.04 * f64::from(k)).exp()).collect(),
            band: 0.068,
        }],
        nis: (1..=2).map(|pass| nis(pass, n)).collect(),
        nis_per_observation: Some(5.1),
        log_likelihood: Some(-1834.27),
        fleet: fleet(),
        conditional_on:
            "The model being right, noise of 2 mmHg without correlation in time, and the stated priors."
                .into(),
        command: "starlings run examples/pig-aorta/study.toml --workers 2".into(),
        version: "0.1.0".into(),
        ..ReportData::default()
    }
}

fn row(name: &str, unit: &str, posterior: [f64; 4], prior: [f64; 3]) -> ParameterRow {
    let [estimate, sd, lo, hi] = posterior;
    let [prior_median, prior_lo, prior_hi] = prior;
    ParameterRow {
        name: name.into(),
        unit: unit.into(),
        estimate,
        sd,
        lo,
        hi,
        other: Some([lo - 1.5 * sd, hi + 1.5 * sd]),
        prior_median,
        prior_lo,
        prior_hi,
    }
}

fn parameters() -> Vec<ParameterRow> {
    vec![
        row("R", "mmHg s/mL", [3.367, 0.021, 3.326, 3.409], [3.0, 0.77, 11.7]),
        row("C", "mL/mmHg", [1.248, 0.013, 1.223, 1.274], [1.0, 0.26, 3.9]),
        row("Zc", "mmHg s/mL", [0.0943, 0.0022, 0.0901, 0.0987], [0.1, 0.0116, 0.862]),
    ]
}

fn time(n: usize) -> Vec<f64> {
    (0..n).map(|k| 4.2 * k as f64 / n as f64).collect()
}

/// A wave that repeats a little imperfectly: deterministic, no generator needed.
fn pressure(t: f64) -> f64 {
    let phase = (t / 0.52).fract();
    98.0 + 34.0 * (std::f64::consts::PI * phase.powf(0.7)).sin() + 2.0 * (1.3 * t).sin()
}

fn channel(n: usize) -> ChannelPlot {
    let time = time(n);
    let misfit = |t: f64| 5.0 * (12.1 * t).sin() * (31.7 * t).cos() + 1.2 * (913.0 * t).sin();
    let missing = |t: f64| (1.0..1.1).contains(&t);
    ChannelPlot {
        record: "in-vivo-1".into(),
        channel: "pressure".into(),
        unit: "mmHg".into(),
        observed: time.iter().map(|&t| (!missing(t)).then(|| pressure(t) + misfit(t))).collect(),
        predicted: time.iter().map(|&t| pressure(t)).collect(),
        spread: time.iter().map(|&t| Some(0.5 + t)).collect(),
        time,
        noise: 2.0,
        train: Some([0.0, 2.31]),
        held_out_channel: false,
        train_rmse: Some(4.431),
        held_out_rmse: Some(4.112),
    }
}

fn track(row: &ParameterRow, n: usize) -> Track {
    let time: Vec<f64> = time(n).into_iter().filter(|t| *t <= 2.31).collect();
    let pass = |pass: usize, start: f64, spread: f64| {
        let settle = |t: f64| (-t / (0.2 * pass as f64)).exp();
        let estimate =
            |t: f64| row.estimate * (start / row.estimate).powf(settle(t)) * (1.0 + 0.01 * (9.0 * t).sin());
        let factor = |t: f64| 1.0 + 2.0 * row.sd / row.estimate + spread * settle(t);
        PassTrack {
            pass,
            time: time.clone(),
            estimate: time.iter().map(|&t| estimate(t)).collect(),
            lo: time.iter().map(|&t| estimate(t) / factor(t)).collect(),
            hi: time.iter().map(|&t| estimate(t) * factor(t)).collect(),
        }
    };
    Track {
        name: row.name.clone(),
        unit: row.unit.clone(),
        prior_median: row.prior_median,
        log_axis: true,
        passes: vec![pass(1, row.prior_median, 1.5), pass(2, row.estimate * 1.04, 0.1)],
    }
}

fn nis(pass: usize, n: usize) -> NisSeries {
    let time: Vec<f64> = time(n).into_iter().filter(|t| *t <= 2.31).collect();
    let value = |t: f64| (2.4 * (12.1 * t).sin() * (31.7 * t).cos()).powi(2) + 0.03 + 0.2 / pass as f64;
    NisSeries {
        pass,
        nis_per_observation: time.iter().map(|&t| value(t)).collect(),
        lo: vec![0.001; time.len()],
        hi: vec![5.02; time.len()],
        n_used: vec![1; time.len()],
        time,
    }
}

fn fleet() -> FleetTable {
    let worker = |name: &str, jobs, failed| WorkerRow {
        name: name.into(),
        host: "node-07".into(),
        jobs,
        failed,
        mean_s: 0.000_214,
        busy_share: Some(0.83),
    };
    let heights = [3, 40, 310, 820, 430, 160, 61, 20, 6, 2];
    let bin = |(k, &count): (usize, &u64)| RunTimeBin {
        from: 5e-5 * (k + 1) as f64,
        to: 5e-5 * (k + 2) as f64,
        count,
    };
    FleetTable {
        workers: vec![worker("local-1", 931, 1), worker("local-2", 922, 0)],
        runs_total: 1852,
        runs_after: 1,
        failed: 1,
        retried: 1,
        rescued: 0,
        time_per_run: Some(RunTimes {
            min: 0.000_061,
            median: 0.000_21,
            p95: 0.000_37,
            max: 0.000_54,
            bins: heights.iter().enumerate().map(bin).collect(),
        }),
        events: vec![
            FleetEvent { time_s: 0.021, text: "worker local-1 joined".into() },
            FleetEvent { time_s: 0.034, text: "worker local-2 joined".into() },
            FleetEvent {
                time_s: 1.802,
                text: "particle 3 failed on local-1 (integrator: step too small), retried on local-2".into(),
            },
        ],
    }
}

//! Invented data of an explanation, for the tests of the page: a pressure that a model without a series resistance misses.

mod figures;

use starlings_explain::locate::MisfitPlace;
use starlings_explain::result::{
    Coefficient, CorrelatedChannel, Experiment, Explanation, FalseAlarm, GapRow, NamedEffect, ParameterShift,
    Rejected, Remaining, Screened,
};
use starlings_explain::{Figures, HeldOut, Kind, NotTried, Verdict};

use super::StudyAbout;

/// An explanation with the given verdict, of `records` recordings with `n` times each.
pub(super) fn found(verdict: Verdict, records: usize, n: usize) -> (Explanation, Figures) {
    let added = matches!(verdict, Verdict::Named | Verdict::Tie);
    let mut explanation = explanation(verdict, records);
    let mut figures = figures::figures(records, n);
    if !added {
        explanation.effects.clear();
        explanation.gap.clear();
        explanation.parameter_shifts.clear();
        explanation.explained_study = None;
        figures.maps_after.clear();
        figures.curves.iter_mut().for_each(|curve| curve.after.clear());
    }
    match verdict {
        Verdict::Named => {}
        Verdict::Tie => {
            explanation.headline = "Characteristic impedance or source gain: the data cannot tell.".into();
            explanation.tied_with = vec![vec!["source-gain".into(), "leak".into()]];
            explanation.experiment = Some(experiment());
        }
        Verdict::Unexplained => {
            explanation.headline = "Nothing in the library explains the gap.".into();
            explanation.closest = vec![effect()];
        }
        Verdict::NoGap => {
            explanation.headline = "No gap: the model explains the training data at their noise.".into();
            explanation.places.clear();
        }
    }
    (explanation, figures)
}

/// What the page says of the study.
pub(super) fn about() -> StudyAbout {
    StudyAbout {
        says: "The two-element model of a pig's aorta, in vivo.".into(),
        command: "starlings explain examples/pig-aorta/explain.toml --workers 2".into(),
        started: "2026-03-02 14:05:31 UTC".into(),
        version: "0.1.0".into(),
        states: vec!["p".into()],
    }
}

fn effect() -> NamedEffect {
    let coefficient = Coefficient {
        name: "Zc".into(),
        unit: "mmHg s/mL".into(),
        estimate: 0.0943,
        sd: 0.0022,
        interval95: [0.0901, 0.0987],
    };
    NamedEffect {
        name: "characteristic-impedance".into(),
        says: "The inlet pressure rises with the flow itself.".into(),
        adds: vec![("pressure".into(), "Zc*flow".into()), ("p".into(), "-leak*p".into())],
        states: vec![("wall".into(), "-wall/tau".into())],
        parameters: vec![coefficient],
        confounders: vec!["inertance".into(), "a gain of the flow meter".into()],
        source: "Westerhof, Lankhaar & Westerhof (2009)".into(),
        kind: Kind::Study,
    }
}

fn experiment() -> Experiment {
    Experiment {
        says: "Double the stroke volume and record the inlet pressure for 4 s.".into(),
        separation: 412.0,
        between: vec!["series-resistance".into(), "quadratic-loss".into()],
        separation_now: 3.1,
        tried: vec![("twice the stroke volume".into(), 412.0), ("twice as long".into(), 6.2)],
    }
}

fn explanation(verdict: Verdict, records: usize) -> Explanation {
    let row = |record: usize, usage: &str, before, after| GapRow {
        record: format!("in-vivo-{record}"),
        channel: "pressure".into(),
        unit: "mmHg".into(),
        usage: usage.into(),
        before,
        after,
        noise: 2.0,
    };
    Explanation {
        study: "pig-aorta".into(),
        model: "windkessel-2".into(),
        seed: 1,
        verdict,
        headline: "The characteristic impedance is missing: 0.0943 mmHg s/mL.".into(),
        probabilities: None,
        places: vec![MisfitPlace {
            channel: "pressure".into(),
            unit: "mmHg".into(),
            from: 0.0,
            to: 2.3,
            region: "flow > 50 mL/s".into(),
            rmse: 14.7,
            interval95: [13.1, 16.2],
            expected: 2.0,
            sentence: "pressure where flow > 50 mL/s: 14.7 mmHg rms against 2.0 expected".into(),
        }],
        effects: vec![effect()],
        replaced: Vec::new(),
        tied_with: Vec::new(),
        tied_gap: Vec::new(),
        tied_forms: Vec::new(),
        experiment: None,
        closest: Vec::new(),
        screened: screened(),
        rejected: vec![Rejected {
            name: "inertance".into(),
            gate: "held-out span".into(),
            reason: "the held-out RMSE grows from 9.1 to 9.8 mmHg".into(),
        }],
        gap: (1..=records)
            .flat_map(|k| [row(k, "train", 9.43, 2.11), row(k, "held-out", 9.12, 2.34)])
            .collect(),
        held_out: held_out(),
        not_tried: not_tried(),
        correlated_noise: correlated_noise(),
        remaining: remaining(),
        false_alarm: false_alarm(),
        parameter_shifts: vec![shift("R", "mmHg s/mL", 3.21, 3.367), shift("C", "mL/mmHg", 1.91, 1.248)],
        untried: vec!["wall-viscosity".into()],
        explained_study: Some("explained.toml".into()),
        conditional_on: "Noise of 2 mmHg, the stated priors, and the library that was tried.".into(),
        runs: 184,
        runs_by_stage: vec![("fit".into(), 32), ("screen".into(), 41), ("refit".into(), 111)],
        workers: 2,
        wall_s: 8.4,
        warnings: vec!["The noise was estimated from the data.".into()],
    }
}

fn not_tried() -> Vec<NotTried> {
    let reason = "this model has no place for it; it needs: a state with the role temperature";
    vec![NotTried { kind: "thermal".into(), reason: reason.into() }]
}

fn held_out() -> Vec<HeldOut> {
    let of = |channel: &str, usage: &str, after: f64| HeldOut {
        record: "in-vivo-1".into(),
        channel: channel.into(),
        usage: usage.into(),
        n: 463,
        before: 4.6,
        after,
        beyond: 0.9 * after,
        fails: after > 2.0,
        mended: 0.7,
        noise: 1.0,
    };
    vec![of("pressure", "held-out", 2.46), of("inlet", "held-out-channel", 1.02)]
}

fn correlated_noise() -> Vec<CorrelatedChannel> {
    let (channel, unit) = ("pressure".into(), "s".into());
    vec![CorrelatedChannel {
        channel,
        share: 0.97,
        length: 0.021,
        unit,
        sd: None,
        channel_unit: String::new(),
    }]
}

fn remaining() -> Remaining {
    Remaining {
        rmse_over_noise: 1.06,
        whiteness_p: 0.000_04,
        whiteness_tested: true,
        inflation: 3.2,
        form_gain: 4.1,
        form_gain_held_out: 0.6,
        form_share: 0.1,
        form_power: 340.0,
        shape: "What remains is a ripple of 0.9 mmHg at 7 1/s.".into(),
    }
}

fn false_alarm() -> FalseAlarm {
    FalseAlarm {
        rate: 0.01,
        upper95: 0.05,
        how: "100 simulations of the fitted model with its noise.".into(),
        runs: 100,
        threshold: 10.0,
        decoys: 0.0,
        nulls: None,
    }
}

fn shift(name: &str, unit: &str, before: f64, after: f64) -> ParameterShift {
    ParameterShift {
        name: name.into(),
        unit: unit.into(),
        before,
        after,
        sd: 0.02,
        in_prior_sd: Some([before - after, 0.02]),
    }
}

fn screened() -> Vec<Screened> {
    let row = |name: &str, share: f64, fate: &str| Screened {
        name: name.into(),
        at: String::new(),
        share,
        gain: 4100.0 * share,
        amplitude: Some(0.09),
        identifiable: 0.6,
        fate: fate.into(),
    };
    vec![
        row("characteristic-impedance", 0.96, "named"),
        row("inertance", 0.41, "refitted"),
        row("offset", 0.02, "absorbed by the parameters"),
    ]
}

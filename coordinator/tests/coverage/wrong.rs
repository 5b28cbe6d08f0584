//! Models that are wrong in one thing: how often a warning comes, and whether the constant that is wrong is named.

use std::sync::Arc;

use starlings_coordinator::study::checked::StudyParameter;
use starlings_coordinator::study::{Study, ThetaEntry};
use starlings_estimators::{Drift, Transform};

use crate::systems::{System, tube};
use crate::tally::run;

/// Beats of the tube that are fitted: enough for intervals of a per cent.
const BEATS: f64 = 3.0;

/// A wrong model, and the constant to name where the data do not show it.
pub(crate) struct Wrong {
    pub(crate) name: &'static str,
    pub(crate) system: System,
    pub(crate) to_blame: Option<&'static str>,
}

/// Draws of one case.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) runs: usize,
    pub(crate) alarmed: usize,
    pub(crate) blamed: usize,
    covered: usize,
    counted: usize,
    largest: f64,
    nis: f64,
    per_percent: f64,
}

impl Found {
    pub(crate) fn over(case: &Wrong, seeds: std::ops::Range<u64>) -> Self {
        let mut found = Self::default();
        for seed in seeds {
            let done = run(&case.system.drawn(seed));
            for (name, truth) in &case.system.truth {
                let z = done.z(&case.system.study, name, *truth).abs();
                found.covered += usize::from(z < 1.959_964);
                found.counted += 1;
                found.largest = found.largest.max(z);
            }
            found.runs += 1;
            found.alarmed += usize::from(!done.alarms().is_empty());
            found.nis += done.summary.fit.nis_per_observation;
            let constants = done.summary.hangs_on.map_or(Vec::new(), |h| h.constants);
            if let Some(of) = constants.iter().find(|c| Some(c.constant.as_str()) == case.to_blame) {
                found.per_percent += of.largest();
                found.blamed += usize::from(of.largest() > 1.0);
            }
        }
        found
    }

    /// A row of the table in docs/coverage.md.
    pub(crate) fn row(&self, case: &Wrong) -> String {
        let n = self.runs as f64;
        let blame = case.to_blame.map_or("–".to_owned(), |constant| {
            format!(
                "{constant}: {:.1} sd per per cent, told in {} of {}",
                self.per_percent / n,
                self.blamed,
                self.runs
            )
        });
        format!(
            "| {} | {} of {} | {:.3} | {:.0} | {:.2} | {blame} |",
            case.name,
            self.alarmed,
            self.runs,
            self.covered as f64 / self.counted as f64,
            self.largest,
            self.nis / n,
        )
    }
}

/// The tube over three beats, the recordings of a right model without noise in it.
fn three_beats() -> System {
    let mut system = tube();
    Arc::make_mut(&mut system.study.records)[0].train = Some([0.0, 0.8 * BEATS]);
    system
}

fn change(name: &'static str, to_blame: Option<&'static str>, change: impl Fn(&mut Study)) -> Wrong {
    let mut system = three_beats();
    change(&mut system.study);
    Wrong { name, system, to_blame }
}

/// Without the true state at time zero, at rest under 60 mmHg instead.
fn wrong_start(study: &mut Study) {
    study.setup.model.constants.retain(|name, _| !name.starts_with("initial:"));
    study.setup.model.constants.insert("p0".to_owned(), 60.0 * 1333.22);
}

pub(crate) fn right() -> Wrong {
    change("nothing: the right model", Some("R_d"), |_| {})
}

pub(crate) fn start() -> Wrong {
    change("start: at rest under 60 instead of 89 mmHg", Some("p0"), wrong_start)
}

/// At rest under a pressure that is estimated, displaced as if every region had the reference stiffness: only the shape of
/// the start is wrong.
pub(crate) fn shape_of_start() -> Wrong {
    change("start: at rest, its pressure estimated, displaced by E_ref", Some("E_ref"), |study| {
        study.setup.model.constants.retain(|name, _| !name.starts_with("initial:"));
        study.setup.model.layout.as_mut().unwrap()["start"] = "reference".into();
        study.setup.parameters.push("p0".to_owned());
        let (mean, sd) = (60.0 * 1333.22, 30.0 * 1333.22);
        study.parameters.push(StudyParameter {
            name: "p0".to_owned(),
            unit: String::new(),
            transform: Transform::Linear,
            per_record: false,
            prior_mean: vec![mean],
            prior_sd: sd,
            drift: Drift::None,
        });
        study.theta.push(ThetaEntry {
            name: "p0".to_owned(),
            parameter: study.parameters.len() - 1,
            record: None,
            prior_mean: mean,
            prior_sd: sd,
            transform: Transform::Linear,
            drift: Drift::None,
        });
    })
}

pub(crate) fn outlet() -> Wrong {
    change("outlet: R_d 5 % too large", Some("R_d"), |study| {
        study.setup.model.constants.insert("R_d".to_owned(), 1.05 * 1850.0);
    })
}

pub(crate) fn forgetting() -> Wrong {
    change("start, and forgetting 0.98 without an observer", None, |study| {
        wrong_start(study);
        study.theta.iter_mut().for_each(|t| t.drift = Drift::Forgetting(0.98));
        study.parameters.iter_mut().for_each(|p| p.drift = Drift::Forgetting(0.98));
    })
}

pub(crate) fn radius() -> Wrong {
    change("displacement measured from 1.02 R", Some("R"), |study| {
        for channel in &mut Arc::make_mut(&mut study.records)[0].channels {
            channel.values.iter_mut().for_each(|v| *v -= 0.02);
        }
    })
}

pub(crate) fn noise(factor: f64, name: &'static str) -> Wrong {
    let mut case = change(name, None, |_| {});
    case.system.factor = factor;
    case
}

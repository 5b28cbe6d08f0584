//! The systems of the battery: the examples, with a truth and draws of the noise.

use std::path::Path;
use std::sync::Arc;

use starlings_coordinator::study::Study;
use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_estimators::BATCH;

use crate::study_kit::normals;

/// A study at default settings, and the values that make its data.
pub(crate) struct System {
    pub(crate) name: &'static str,
    /// The study; its recordings hold the truth without noise.
    pub(crate) study: Study,
    /// Estimated parameters and their true values.
    pub(crate) truth: Vec<(&'static str, f64)>,
    /// The noise of a draw over the noise that the study states.
    pub(crate) factor: f64,
}

impl System {
    pub(crate) fn of(name: &'static str, example: &str, truth: &[(&'static str, f64)]) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(example);
        let mut study = Study::load(&path).unwrap_or_else(|error| panic!("{error}"));
        study.estimator.passes = None;
        fill(&mut study, truth);
        Self { name, study, truth: truth.to_vec(), factor: 1.0 }
    }

    /// The study of one draw of the noise, of the sd that it states.
    pub(crate) fn drawn(&self, seed: u64) -> Study {
        let mut study = self.study.clone();
        for channel in Arc::make_mut(&mut study.records).iter_mut().flat_map(|r| &mut r.channels) {
            let noise = normals(channel.values.len(), 1000 * seed + channel.row as u64);
            channel.values.iter_mut().zip(noise).for_each(|(z, e)| *z += self.factor * channel.noise * e);
        }
        study
    }
}

/// Puts the truth into the recordings.
pub(crate) fn fill(study: &mut Study, truth: &[(&str, f64)]) {
    let values: Vec<(String, f64)> = truth.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let made = simulate(study, &Twin { values, ..Twin::default() }).unwrap();
    for channel in &mut Arc::make_mut(&mut study.records)[0].channels {
        let column = made.columns.iter().position(|name| *name == channel.output).unwrap();
        channel.values.clone_from(&made.values[column]);
    }
}

/// The same study, estimated by the batch fit.
pub(crate) fn by_batch(study: &Study) -> Study {
    let mut study = study.clone();
    study.estimator.kind = &BATCH;
    study.estimator.spread = 0.1;
    study
}

const RCR: [(&str, f64); 4] = [("Zc", 150.0), ("R", 1850.0), ("C", 1e-3), ("initial:p", 114_900.0)];

pub(crate) fn rcr() -> System {
    System::of("rcr", "rcr/study.toml", &RCR)
}

/// Priors of twice the logarithmic sd.
pub(crate) fn rcr_wide() -> System {
    let mut system = System::of("rcr, wide priors", "rcr/study.toml", &RCR);
    for entry in system.study.theta.iter_mut().filter(|t| !t.name.starts_with("initial:")) {
        entry.prior_sd *= 2.0;
    }
    for parameter in system.study.parameters.iter_mut().filter(|p| !p.name.starts_with("initial:")) {
        parameter.prior_sd *= 2.0;
    }
    system
}

pub(crate) fn tissue() -> System {
    System::of("tissue", "fsi-tube/tissue.toml", &[("k_s", 2e5), ("c_s", 5e3)])
}

/// Young's moduli of five regions.
pub(crate) const TUBE: [(&str, f64); 5] = [
    ("E1", 7_071_067.811_865),
    ("E2", 14_142_135.623_731),
    ("E3", 3_535_533.905_933),
    ("E4", 5e6),
    ("E5", 2.5e6),
];

pub(crate) fn tube() -> System {
    System::of("tube", "fsi-tube/study.toml", &TUBE)
}

/// The tube in its periodic state, which every run finds by itself.
pub(crate) fn periodic() -> System {
    System::of("tube, periodic start", "fsi-tube/periodic.toml", &TUBE)
}

/// The same recordings, fitted by runs that start at rest under 80 mmHg, displaced by the reference stiffness.
pub(crate) fn reference() -> System {
    let mut system = System { name: "periodic tube, `reference` start", ..periodic() };
    system.study.setup.periods.clear();
    let layout = system.study.setup.model.layout.as_mut().and_then(|layout| layout.as_object_mut());
    layout.unwrap().insert("start".to_owned(), "reference".into());
    system
}

pub(crate) const ARTERY: [(&str, f64); 5] = [
    ("E_aorta", 4e6),
    ("E_left", 1.2e7),
    ("R_d_left_leg", 3000.0),
    ("R_d_right_leg", 4500.0),
    ("p0", 103_991.16),
];

pub(crate) fn artery_1d() -> System {
    System::of("artery-1d", "artery-1d/study.toml", &ARTERY)
}

pub(crate) fn coarctation() -> System {
    let truth = [
        ("Rp_bca", 0.35),
        ("C_bca", 0.25),
        ("Rd_bca", 5.0),
        ("Rp_lcca", 0.9),
        ("C_lcca", 0.09),
        ("Rd_lcca", 12.0),
        ("Rp_lsa", 0.6),
        ("C_lsa", 0.14),
        ("Rd_lsa", 8.5),
        ("Rp_dao", 0.12),
        ("C_dao", 0.8),
        ("Rd_dao", 1.55),
        ("C_wall", 0.35),
        ("shift_inflow", -0.03),
        ("initial:stored_p_asc", 69.8),
        ("initial:stored_p_bca", 68.0),
        ("initial:stored_p_lcca", 68.0),
        ("initial:stored_p_lsa", 68.2),
        ("initial:stored_p_dao", 69.0),
        ("initial:stored_q_isthmus", 8.0),
    ];
    System::of("coarctation", "coarctation/study.toml", &truth)
}

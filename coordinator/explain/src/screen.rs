//! The screening: one run per candidate and point of its grid tells what it would add to a finished fit.
//!
//! A run with a small amplitude gives the sensitivity of every row; the score test projects the fitted parameters out of it.
//! All candidates go to the fleet in one batch; those whose response was too small or too large for a derivative go a second
//! time. Next files to read: [`response`], `score.rs` of the estimators, then [`super::search`].

mod response;

use std::sync::Arc;

use starlings_estimators::Score;
use starlings_models::SetupError;

use response::{Next, Response, Scale};
use starlings_study::Record;

use super::ExplainError;
use super::candidate::Candidate;
use super::fit::Fitted;
use super::influence::Influence;
use super::laboratory::{Laboratory, Point};
use super::locate::Track;
use super::probe::{Along, natural_amplitude};
use super::version::{Member, Version};

/// Probe, as a share of what the term is added to.
const PROBE: f64 = 3e-3;
/// Times that a candidate is measured again.
const AGAIN: usize = 2;
/// Part of its own below which a candidate's influence counts as imitated by the parameters.
pub(crate) const ABSORBED: f64 = 0.05;

/// Why a probe has no answer that the budget did not suffice for.
const UNAFFORDED: &str = "the budget ended before its influence was measured";
/// The score of what was not measured.
const NO_SCORE: Score = Score { gain: 0.0, amplitude: 0.0, sd: f64::INFINITY, identifiable: 0.0 };

/// A candidate at one point of its grid, measured at a fit.
#[derive(Clone, Debug)]
pub(crate) struct Hit {
    /// Position among the candidates.
    pub candidate: usize,
    /// Values of its parameters after the amplitude.
    pub point: Vec<f64>,
    /// What it changes; nothing where there is none.
    pub influence: Influence,
    /// Its score.
    pub score: Score,
    /// Why it has no sensitivity.
    pub failure: Option<String>,
}

impl Hit {
    /// Fall of χ² with an amplitude of a sign that physics allows.
    pub(crate) fn allowed_gain(&self, sign: f64) -> f64 {
        if self.score.amplitude * sign >= 0.0 { self.score.gain } else { 0.0 }
    }

    /// Whether the parameters imitate it.
    pub(crate) fn is_absorbed(&self) -> bool {
        self.failure.is_none() && self.score.identifiable < ABSORBED
    }
}

/// A probe under way.
struct Probe<'c> {
    candidate: usize,
    version: Version<'c>,
    point: Vec<f64>,
    amplitude: f64,
    answer: Option<Result<Felt, String>>,
}

/// An influence that was measured.
struct Felt {
    influence: Influence,
    score: Score,
    /// Whether the rows that train feel nothing of it.
    is_unfelt: bool,
}

/// Measures candidates at a fit: `of` names (candidate, point of its grid). Effects that the fit has already are left out.
/// Where the budget does not suffice for all of them, none is measured, and what it does not suffice to measure again counts
/// as failed; the laboratory notes it.
///
/// # Errors
/// When the fleet or the store fails, or the fit leaves a direction free.
pub(crate) fn screen<'c>(
    laboratory: &mut Laboratory<'_>,
    fit: &Fitted<'c>,
    candidates: &'c [Candidate],
    of: &[(usize, usize)],
    tracks: &[Track],
) -> Result<Vec<Hit>, ExplainError> {
    let optimum = fit.optimum()?;
    let (mut probes, mut unfit) = (Vec::new(), Vec::new());
    for &(index, point) in of {
        if fit.version.members.iter().any(|m| m.candidate.name() == candidates[index].name()) {
            continue;
        }
        match probe(fit, candidates, index, point, tracks) {
            Ok(probe) => probes.push(probe),
            // Two effects of one study may share a name inside, and then cannot stand in one model.
            Err(error) => unfit.push(unfit_hit(index, &candidates[index].points[point], &error)),
        }
    }
    let spread = spread(laboratory);
    let unmoved = unmoved(fit, &probes);
    if !laboratory.affords(probes.len() + usize::from(unmoved.is_some())) {
        laboratory.cut_short();
        return Ok(Vec::new());
    }
    let reference = reference(laboratory, fit, unmoved)?;
    let scale = Scale { optimum: &optimum, spread: &spread, is_held: laboratory.holds(probes.len()) };
    for round in 0..=AGAIN {
        let open: Vec<usize> = (0..probes.len()).filter(|i| probes[*i].answer.is_none()).collect();
        if !laboratory.affords(open.len()) {
            laboratory.cut_short();
            for i in open {
                probes[i].answer = Some(Err(UNAFFORDED.to_owned()));
            }
            break;
        }
        let points: Vec<Point<'_>> = open.iter().map(|i| at(fit, &probes[*i])).collect();
        let mut found = Vec::with_capacity(open.len());
        laboratory.run_each(&points, |laboratory, k, runs, answer| {
            let probe = &probes[open[k]];
            let base = if touches_states(probe) { &reference } else { &fit.predicted };
            let response = Response { probe, answer, runs, base };
            found.push(response.next(laboratory, &scale, round == AGAIN));
        })?;
        drop(points);
        for (i, next) in open.into_iter().zip(found) {
            match next {
                Next::Amplitude(amplitude) => probes[i].amplitude = amplitude,
                Next::Answer(answer) => probes[i].answer = Some(answer),
            }
        }
    }
    Ok(probes.into_iter().map(hit).chain(unfit).collect())
}

/// A first guess of a probe.
fn probe<'c>(
    fit: &Fitted<'c>,
    candidates: &'c [Candidate],
    index: usize,
    point: usize,
    tracks: &[Track],
) -> Result<Probe<'c>, SetupError> {
    let candidate = &candidates[index];
    let point = candidate.points[point].clone();
    let study = &fit.version.study;
    let record = study.records.iter().position(Record::is_trained).unwrap_or(0);
    let theta = study.theta_for(record, fit.theta().as_slice());
    let along = Along { study, theta: &theta, tracks };
    let [lo, hi] = candidate.def.parameters[0].range;
    let natural = natural_amplitude(&along, candidate, &point).map_or_else(
        || if lo.is_finite() && hi.is_finite() { PROBE * (hi - lo) } else { PROBE },
        |natural| PROBE * natural,
    );
    let sign = if candidate.sign() < 0.0 { -1.0 } else { 1.0 };
    let amplitude = sign * natural.min(if hi > 0.0 { hi } else { lo.abs() });
    let members = fit.version.members.iter().cloned();
    let members = members.chain([Member { candidate, index, unit: 1.0 }]).collect();
    let version = Version::new(fit.version.base, members, &fit.version.left_out)?;
    Ok(Probe { candidate: index, version, point, amplitude, answer: None })
}

fn at<'p>(fit: &Fitted<'_>, probe: &'p Probe<'_>) -> Point<'p> {
    let mut z = probe.version.continue_from(&fit.version, fit.z(), &probe.point);
    z[probe.version.first_of(probe.version.members.len() - 1)] = probe.amplitude;
    Point { study: &probe.version.study, theta: probe.version.theta(&z) }
}

/// Whether the effect changes how the states are integrated.
fn touches_states(probe: &Probe<'_>) -> bool {
    let Some(member) = probe.version.members.last() else { return false };
    let outputs = &probe.version.study.spec.outputs;
    let states = &probe.version.study.spec.states;
    let only_output = |to: &str| outputs.iter().any(|q| q.name == to) && !states.iter().any(|q| q.name == to);
    !(member.candidate.def.states.is_empty() && member.candidate.def.adds.iter().all(|a| only_output(&a.to)))
}

/// The fitted model with an effect of amplitude zero in its rates, where that is not the fitted model to the bit: a built-in
/// model with a step of its own is then integrated in another way, and that difference is not the effect's doing.
fn unmoved<'p>(fit: &Fitted<'_>, probes: &'p [Probe<'_>]) -> Option<Point<'p>> {
    let own_step = fit.version.study.setup.model.equations.is_none();
    let probe = probes.iter().find(|p| touches_states(p)).filter(|_| own_step)?;
    let z = probe.version.continue_from(&fit.version, fit.z(), &probe.point);
    Some(Point { study: &probe.version.study, theta: probe.version.theta(&z) })
}

/// What predictions with an effect in the rates are compared with.
fn reference(
    laboratory: &mut Laboratory<'_>,
    fit: &Fitted<'_>,
    unmoved: Option<Point<'_>>,
) -> Result<Arc<Vec<f64>>, ExplainError> {
    let Some(point) = unmoved else { return Ok(Arc::clone(&fit.predicted)) };
    let answer = laboratory.run(&[point])?.swap_remove(0);
    Ok(answer.unwrap_or_else(|_| Arc::clone(&fit.predicted)))
}

/// Spread of the observed values of each row's channel, over all records.
fn spread(laboratory: &Laboratory<'_>) -> Vec<f64> {
    let n_output = laboratory.study.setup.outputs.len();
    let mut sums = vec![(0.0, 0.0, 0.0); n_output];
    for row in &laboratory.rows.rows {
        let (n, sum, square) = &mut sums[row.output];
        *n += 1.0;
        *sum += row.observed;
        *square += row.observed * row.observed;
    }
    let sd = |(n, sum, square): &(f64, f64, f64)| ((square - sum * sum / n) / n).max(0.0).sqrt();
    let by_output: Vec<f64> = sums.iter().map(sd).collect();
    laboratory.rows.rows.iter().map(|row| by_output[row.output].max(row.noise)).collect()
}

/// A candidate that does not go with what the model has already.
fn unfit_hit(candidate: usize, point: &[f64], error: &SetupError) -> Hit {
    Hit {
        candidate,
        point: point.to_vec(),
        influence: Influence::none(),
        score: NO_SCORE,
        failure: Some(error.to_string()),
    }
}

fn hit(probe: Probe<'_>) -> Hit {
    let Probe { candidate, point, answer, .. } = probe;
    let reason = match answer.unwrap_or_else(|| Err(String::new())) {
        Ok(Felt { influence, score, is_unfelt }) => {
            let failure = is_unfelt.then(|| "no influence on what is fitted".to_owned());
            return Hit { candidate, point, influence, score, failure };
        }
        Err(reason) if reason.is_empty() => "no influence on what was measured".to_owned(),
        Err(reason) => reason,
    };
    Hit { candidate, point, influence: Influence::none(), score: NO_SCORE, failure: Some(reason) }
}

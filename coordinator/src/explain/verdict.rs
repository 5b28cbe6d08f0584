//! From what the search found to a verdict: named, tie, unexplained or no gap.
//!
//! A name says that one version passes every gate, that no rival comes close, and that what it leaves is not of the library's
//! making. Anything less is a tie or unexplained, with what came nearest. Next file to read: [`super::answer`].

use nalgebra::DVector;
use starlings_estimators::effective_sample_size;
use starlings_models::equations::{Expression, Slot};

use super::Verdict;
use super::candidate::Candidate;
use super::carried::{Carried, carried};
use super::form::{Leftover, white_share};
use super::judge::Judged;
use super::laboratory::Laboratory;
use super::search::{Found, NOT_WHITE};

/// A rival within this fall of χ², in units of the effective noise, is tied.
const MARGIN: f64 = 6.0;
/// Candidates whose influence resembles each other this much cannot be told apart by any refit.
const ALIKE: f64 = 0.995;
/// A rival is tied where the difference in χ² is less than so many of its standard deviations.
const VUONG: f64 = 1.64;
/// Effective variance of the residuals above which what remains is a discrepancy of its own, not the form of an effect.
pub(super) const DISCREPANT: f64 = 20.0;
/// Share of white noise in the residuals from which on they must be white altogether.
const AUDIBLE: f64 = 0.12;
/// ... where their effective variance says that the structure matters.
const STRUCTURED: f64 = 3.0;
/// Fall of χ² by a fully bent form from which on a form bent by half, which makes a quarter of it, passes the 12 units of the
/// check of the form nine times in ten: 4 (√12 + 1.28)².
const POWER: f64 = 90.0;
/// Share of the gap of the held-out span that may be left unaccounted for where the training residuals are noise.
const UNACCOUNTED: f64 = 0.15;
/// Posterior over prior standard deviation of a parameter inside a term from which on the data do not tell it.
const UNINFORMED: f64 = 0.5;
/// Where the residuals stay correlated, an effect must take away this share of the excess of the training rows ...
const SHARE: f64 = 0.5;
/// ... and this share of that of the held-out span.
const SHARE_HELD_OUT: f64 = 0.4;
/// ... and no more than this share of the decoys may do as well.
const DECOYS: f64 = 0.05;

/// The verdict, with positions in [`Found::judged`].
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// What is named, or the best of the tied, or what came nearest.
    pub best: Option<usize>,
    /// What came first by rank, whose form was checked: of a tie `best` is the simplest.
    pub checked: Option<usize>,
    /// Names of the sets of effects tied with the best.
    pub tied: Vec<Vec<String>>,
    /// Positions of those of the tied that were refitted.
    pub rivals: Vec<usize>,
    /// Why it is not named, in words.
    pub because: String,
}

/// Decides.
pub fn decide(laboratory: &Laboratory<'_>, found: &Found<'_>, candidates: &[Candidate]) -> Decision {
    let none = |verdict, best, because: &str| Decision {
        verdict,
        best,
        checked: best,
        tied: Vec::new(),
        rivals: Vec::new(),
        because: because.to_owned(),
    };
    let passing = found.passing();
    if passing.is_empty() {
        return if found.whiteness < NOT_WHITE {
            none(Verdict::Unexplained, None, &nearest_refused(found))
        } else {
            none(Verdict::NoGap, None, "")
        };
    }
    let Carried { best, checked, because } = carried(found, &passing);
    let judged = &found.judged[best];
    let leftover = found.judged[checked].leftover.unwrap_or_default();
    let because = because.or_else(|| doubt(laboratory, found, judged, leftover));
    if let Some(because) = because {
        return Decision { checked: Some(checked), ..none(Verdict::Unexplained, Some(best), &because) };
    }
    // What remains beside a discrepancy of its own tells nothing of a form.
    let is_tested = judged.inflation > DISCREPANT || leftover.power >= POWER;
    let mut rivals = rivals(laboratory, found, &passing, best);
    // Of forms that the data cannot tell apart the simplest is shown.
    let mut best = best;
    for rival in &mut rivals {
        if complexity(&found.judged[*rival]) < complexity(&found.judged[best]) {
            std::mem::swap(rival, &mut best);
        }
    }
    let judged = &found.judged[best];
    let mut tied: Vec<Vec<String>> = rivals.iter().map(|i| names(&found.judged[*i])).collect();
    for twin in twins(laboratory, found, judged, candidates) {
        if !tied.contains(&twin) {
            tied.push(twin);
        }
    }
    if !is_tested {
        tied.push(vec![format!("another form of {}", judged.fit.version.name())]);
    }
    tied.extend(limits(judged).into_iter().map(|limit| vec![limit]));
    let verdict = if tied.is_empty() { Verdict::Named } else { Verdict::Tie };
    Decision { verdict, best: Some(best), checked: Some(checked), tied, rivals, because: String::new() }
}

/// The limiting forms that the data do not exclude: a parameter inside a term of which they say little.
fn limits(judged: &Judged<'_>) -> Vec<String> {
    let version = &judged.fit.version;
    let Ok(optimum) = judged.fit.optimum() else { return Vec::new() };
    let mut limits = Vec::new();
    for (m, member) in version.members.iter().enumerate() {
        for (k, parameter) in member.candidate.def.parameters.iter().enumerate().skip(1) {
            let j = version.first_of(m) + k;
            // z counts in prior sd.
            let sd = (optimum.covariance()[(j, j)].max(0.0) * judged.inflation).sqrt();
            if sd > UNINFORMED {
                limits.push(format!("{} at a limit of {}", member.candidate.name(), parameter.name));
            }
        }
    }
    limits
}

/// Names of the effects of a version.
pub fn names(judged: &Judged<'_>) -> Vec<String> {
    judged.fit.version.members.iter().map(|m| m.candidate.name().to_owned()).collect()
}

/// Which candidate came nearest and the gate that refused it.
fn nearest_refused(found: &Found<'_>) -> String {
    let nearest = found.judged.first().and_then(|j| Some((j, j.refusal.as_ref()?)));
    nearest.map_or_else(
        || "no candidate gains more than chance".to_owned(),
        |(judged, refusal)| {
            let name = judged.fit.version.name();
            format!(
                "`{name}` comes nearest and is refused by the gate `{}`: {}",
                refusal.gate, refusal.reason
            )
        },
    )
}

/// What speaks against naming a version that passes the gates.
fn doubt(
    laboratory: &Laboratory<'_>,
    found: &Found<'_>,
    judged: &Judged<'_>,
    left: Leftover,
) -> Option<String> {
    if left.is_systematic {
        return Some(format!(
            "`{}` comes nearest, but other candidates or a bent form of it would still take away {:.0} of χ² and {:.0} on the \
             held-out span, in units of the effective noise: its form is not right",
            judged.fit.version.name(),
            left.gain,
            left.gain_held_out
        ));
    }
    let name = judged.fit.version.name();
    if judged.whiteness >= NOT_WHITE {
        return (judged.unaccounted > UNACCOUNTED).then(|| {
            format!(
                "with `{name}` nothing but noise is left of the training data, yet at least {:.0} % of the gap of the held-out \
                 span stays beyond the uncertainty of the estimate: its form does not carry on",
                100.0 * judged.unaccounted
            )
        });
    }
    let white = white_share(&laboratory.rows, judged.fit.residual());
    if white > AUDIBLE && judged.inflation > STRUCTURED {
        return Some(format!(
            "`{name}` takes away {:.0} % of the gap, but white noise makes {:.0} % of what is left and so shows that the rest is \
             none: its form is not right, or something else is missing too",
            100.0 * judged.share,
            100.0 * white
        ));
    }
    let short = |share: f64, what: &str| {
        format!(
            "`{name}` takes away only {:.0} % of the gap on the {what}, and what is left is not noise",
            100.0 * share
        )
    };
    if judged.share < SHARE {
        return Some(short(judged.share, "training data"));
    }
    if let Some(share) = judged.share_held_out.filter(|s| *s < SHARE_HELD_OUT) {
        return Some(short(share, "held-out span"));
    }
    let decoys = found.background.decoys_above(judged.gain);
    (decoys > DECOYS).then(|| {
        format!(
            "{:.0} % of the decoys take away as much as `{name}`, and what is left is not noise",
            100.0 * decoys
        )
    })
}

/// Other versions that pass the gates and come as close as chance allows: by the fall of χ², or, up to twice that margin,
/// because the difference of their residuals is not clearly of one sign (Vuong 1989, with the autocorrelation of that
/// difference).
fn rivals(laboratory: &Laboratory<'_>, found: &Found<'_>, passing: &[usize], best: usize) -> Vec<usize> {
    let of_best = &found.judged[best];
    let size = of_best.fit.version.members.len();
    let near = |i: &usize| {
        let judged = &found.judged[*i];
        let apart = of_best.rank() - judged.rank();
        *i != best
            && judged.fit.version.members.len() == size
            && names(judged) != names(of_best)
            && (apart < MARGIN * of_best.inflation
                || (apart < 2.0 * MARGIN * of_best.inflation
                    && apart < VUONG * scatter(laboratory, of_best, judged)))
    };
    passing.iter().copied().filter(near).collect()
}

/// Standard deviation of the difference in χ² of two versions, over all rows.
fn scatter(laboratory: &Laboratory<'_>, a: &Judged<'_>, b: &Judged<'_>) -> f64 {
    let rows = &laboratory.rows;
    let (of_a, of_b) = (rows.whitened(&a.fit.predicted), rows.whitened(&b.fit.predicted));
    let variance = |stretch: std::ops::Range<usize>| {
        let apart: Vec<f64> = stretch.map(|i| of_b[i].powi(2) - of_a[i].powi(2)).collect();
        let n = apart.len() as f64;
        let mean = apart.iter().sum::<f64>() / n;
        let square = apart.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
        let effective = effective_sample_size(&apart);
        square * if effective > 0.0 { (n / effective).max(1.0) } else { 1.0 }
    };
    rows.stretches().into_iter().map(variance).sum::<f64>().sqrt()
}

/// Operations in the terms of a version: of the tied, the simplest is shown.
fn complexity(judged: &Judged<'_>) -> usize {
    let terms = judged.fit.version.members.iter().flat_map(|m| &m.candidate.def.adds);
    let resolve = |_: &str| Some(Slot::Parameter(0));
    let size = |term: &String| Expression::parse(term).ok()?.compile(&resolve, &|_| None).ok();
    terms.filter_map(|add| size(&add.term)).map(|program| program.n_operations()).sum()
}

/// Candidates that were not refitted but whose influence is that of the best.
fn twins(
    laboratory: &Laboratory<'_>,
    found: &Found<'_>,
    judged: &Judged<'_>,
    candidates: &[Candidate],
) -> Vec<Vec<String>> {
    let [member] = judged.fit.version.members.as_slice() else { return Vec::new() };
    let Ok(optimum) = found.base.optimum() else { return Vec::new() };
    let own = |s: &DVector<f64>| optimum.unimitated(&s.select_rows(&laboratory.rows.train));
    let best = found.hits.iter().filter(|h| h.candidate == member.index && h.failure.is_none());
    let Some(best) = best.max_by(|a, b| a.score.gain.total_cmp(&b.score.gain)) else { return Vec::new() };
    let best = own(&best.sensitivity);
    let mut twins: Vec<Vec<String>> = Vec::new();
    for hit in found.hits.iter().filter(|h| h.failure.is_none() && !h.is_absorbed()) {
        let refitted = found
            .judged
            .iter()
            .any(|j| j.fit.version.members.len() == 1 && j.fit.version.members[0].index == hit.candidate);
        let other = own(&hit.sensitivity);
        let alike = best.dot(&other).abs() / (best.norm() * other.norm());
        let candidate = &candidates[hit.candidate];
        let name = vec![candidate.name().to_owned()];
        let allowed = hit.allowed_gain(candidate.sign()) > 0.0;
        if !refitted && allowed && alike > ALIKE && !twins.contains(&name) {
            twins.push(name);
        }
    }
    twins
}

//! The sentences of an explanation.
//!
//! Next file to read: [`super::result`].

use starlings_models::SOLVER;

use super::Verdict;
use super::candidate::Candidate;
use super::fit::Fitted;
use super::judge::Judged;
use super::laboratory::Laboratory;
use super::locate::Located;
use super::rows::Usage;
use super::search::{Found, NOT_WHITE};
use super::verdict::{DISCREPANT, Decision};

/// Where a fit stands that has not converged.
pub(super) fn stand(fit: &Fitted<'_>) -> String {
    let n = fit.residual().len().max(1) as f64;
    let rms = (fit.residual().norm_squared() / n).sqrt();
    format!("{} (root mean square residual {rms:.3} noise sd)", super::run::values(fit))
}

/// The verdict in one or two sentences.
pub(super) fn headline(laboratory: &Laboratory<'_>, found: &Found<'_>, decision: &Decision) -> String {
    let base = |usage| laboratory.rows.rmse(&found.base.predicted, |row| row.usage == usage);
    let best = decision.best.map(|i| &found.judged[i]);
    match (decision.verdict, best) {
        (Verdict::Named, Some(judged)) => {
            format!("{} {}", subject(judged), capital(&shrinking(laboratory, found, judged)))
        }
        (Verdict::Tie, Some(judged)) => {
            let rivals: Vec<String> = decision.tied.iter().map(|set| set.join(" + ")).collect();
            format!(
                "{} or {}: the data cannot tell them apart. {}",
                judged.fit.version.name(),
                rivals.join(" or "),
                capital(&shrinking(laboratory, found, judged))
            )
        }
        (Verdict::Unexplained, _) => {
            let because =
                if decision.because.is_empty() { String::new() } else { format!(": {}", decision.because) };
            format!("Nothing in the library explains the gap{}.", because.trim_end_matches('.'))
        }
        _ => format!(
            "No gap: the model explains the data at their noise (root mean square residual {:.3} on the training data).",
            base(Usage::Train)
        ),
    }
}

fn subject(judged: &Judged<'_>) -> String {
    let version = &judged.fit.version;
    let says: Vec<&str> = version.members.iter().map(|m| m.candidate.def.says.as_str()).collect();
    format!("Missing: {}. {}", version.name(), says.join(" "))
}

/// How the gap shrinks, for each use that there is.
fn shrinking(laboratory: &Laboratory<'_>, found: &Found<'_>, judged: &Judged<'_>) -> String {
    let noise = |y: &[f64], usage| {
        let whitened = laboratory.rows.whitened(y);
        let of = laboratory.rows.rows.iter().zip(&whitened).filter(|(row, _)| row.usage == usage);
        let (n, sum) = of.fold((0.0, 0.0), |(n, sum), (_, e)| (n + 1.0, sum + e * e));
        (n > 0.0).then(|| f64::sqrt(sum / n))
    };
    let spans = [
        (Usage::Train, "the training data"),
        (Usage::HeldOut, "the held-out span"),
        (Usage::HeldOutChannel, "the held-out channels"),
    ];
    let part = |(usage, what)| {
        let before = noise(&found.base.predicted, usage)?;
        let after = noise(&judged.fit.predicted, usage)?;
        Some(format!("from {before:.2} to {after:.2} noise sd on {what}"))
    };
    let parts: Vec<String> = spans.into_iter().filter_map(part).collect();
    format!("the error falls {}.", parts.join(", "))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The shape of what remains.
pub(super) fn shape(found: &Found<'_>, added: Option<&Judged<'_>>, before: &Located) -> String {
    let white = added.map_or(found.whiteness, |j| j.whiteness) >= NOT_WHITE;
    if white {
        return "what remains could be noise".to_owned();
    }
    let strongest = before.correlations.first();
    if let Some(judged) = added {
        return format!(
            "what remains is correlated in time (its squares count {:.0}-fold for smooth signals) and no candidate takes it away",
            judged.inflation
        );
    }
    let with = strongest.map_or_else(String::new, |c| format!(", and goes along with {}", c.with));
    format!("what remains is correlated in time{with}")
}

/// What the intervals and the verdict rest on.
pub(super) fn conditional_on(added: Option<&Judged<'_>>) -> String {
    let noise = added.map_or_else(String::new, |j| {
        format!(
            " Intervals are widened by {:.2} for the size and correlation of the residuals.",
            j.inflation.sqrt()
        )
    });
    format!(
        "A verdict names the best member of this library; an effect that is not in it can resemble one that is. Intervals hold \
         for the model with the named effects, the stated noise, and parameters close to linear within them.{noise}"
    )
}

/// Candidates that a budget left without an answer.
pub(super) fn untried(found: &Found<'_>, candidates: &[Candidate]) -> Vec<String> {
    if !found.cut_short {
        return Vec::new();
    }
    let seen =
        |index: usize| found.judged.iter().any(|j| j.fit.version.members.iter().any(|m| m.index == index));
    let open = candidates.iter().enumerate().filter(|(i, _)| !seen(*i));
    open.map(|(_, c)| c.name().to_owned()).collect()
}

/// What a fit that did not come to its end leaves in doubt.
fn unfinished(fit: &Fitted<'_>) -> Option<String> {
    let name = fit.version.name();
    if !fit.has_converged() {
        return Some(format!(
            "the fit with {name} has not converged after {} steps: its figures are those of where it stands",
            fit.trials()
        ));
    }
    (!fit.is_fresh()).then(|| {
        format!(
            "the fit with {name} ended without a measured Jacobian: its standard deviations and intervals rest on a secant \
             approximation"
        )
    })
}

/// What is doubtful.
pub(super) fn warnings(laboratory: &Laboratory<'_>, found: &Found<'_>, decision: &Decision) -> Vec<String> {
    let mut list = Vec::new();
    if found.cut_short {
        list.push(format!(
            "the budget ended the search after {} runs: candidates named under `untried` were not refitted",
            laboratory.runs()
        ));
    }
    if !laboratory.rows.rows.iter().any(|row| row.usage != Usage::Train) {
        list.push(
            "nothing is held out: neither a span nor a channel could speak against a name; set `train` or \
             `hold_out_channels`"
                .to_owned(),
        );
    }
    if decision.verdict != Verdict::NoGap && laboratory.study.setup.model.kind == SOLVER {
        let why = "the unknown input of every equation was not looked for: the rates of a solver are not open to one";
        list.push(why.to_owned());
    }
    let n = laboratory.rows.train.len().max(1) as f64;
    let ratio = found.base.residual().norm_squared() / n;
    if decision.verdict == Verdict::NoGap && !(0.5..=1.5).contains(&ratio) {
        list.push(format!(
            "the residuals of the model as it is are white, but their variance is {ratio:.2} times that of the stated noise: \
             check the noise"
        ));
    }
    let best = decision.best.map(|i| &found.judged[i]);
    list.extend(best.and_then(|judged| unfinished(&judged.fit)));
    if let Some(judged) = best.filter(|j| j.inflation > 3.0) {
        list.push(format!(
            "residuals stay correlated or larger than the stated noise (effective variance {:.1}): evidence and intervals are \
             scaled by it",
            judged.inflation
        ));
    }
    if let Some(judged) =
        best.filter(|j| j.inflation > DISCREPANT && decision.verdict != Verdict::Unexplained)
    {
        list.push(format!(
            "what `{}` leaves is a discrepancy of its own and no noise: whether another form of it would serve as well was not \
             tested",
            judged.fit.version.name()
        ));
    }
    list
}

//! Whether several observers of a study go together: each state has one, and what is stable under each is stable under all.
//!
//! Both are judged at the prior medians, where `starlings spectrum` looks too. Next file to read: [`crate::spectrum`].

use starlings_models::catalogue::NATIVE;
use starlings_models::spectrum::{LinearisedSetup, SpectrumError};
use starlings_models::{BuildSetup, SOLVER, quoted_list};

use super::load::Purpose;
use crate::file::ObserverSection;
use crate::problem::Source;
use crate::{Study, posterior};

/// Reports observers that correct the same state, or are unstable together though each is stable.
pub(super) fn check(source: &Source, section: &ObserverSection, study: &Study, purpose: Purpose) {
    if section.beside.is_empty() || study.setup.model.kind == SOLVER {
        return;
    }
    let sections: Vec<&ObserverSection> = section.all().collect();
    // A model that no matrix describes where its runs start is told by `starlings spectrum`.
    let Ok(linearised) = linearised(study) else { return };
    if let Ok(Some((first, second, state))) = linearised.shared_state() {
        let outputs = linearised.outputs_read().unwrap_or_default();
        let told = |at: usize| {
            let of = outputs.get(at).map_or_else(String::new, |of| format!(" by {}", quoted_list(of)));
            format!("`{}`{of}", sections[at].kind.get_ref())
        };
        source.report_with(
            sections[second].kind.span(),
            format!("the observers {} and {} both correct the state `{state}`", told(first), told(second)),
            "keep one of the two, or give them states of their own; where two of one kind stand, `corrects` names the outputs of each",
        );
        return;
    }
    if purpose == Purpose::Poles {
        return;
    }
    let Ok((together, alone)) = linearised.together_and_alone() else { return };
    if disagree(together, &alone, linearised.rounding()) {
        let (name, unit) = (study.setup.observer.name(), &study.time_unit);
        source.report_with(
            section.kind.span(),
            format!(
                "the observers `{name}` are each stable and unstable together: the slowest error grows with {together:.3} 1/{unit}"
            ),
            format!("{}`starlings spectrum` shows the poles, with the gains in proportion", remedy(&linearised)),
        );
    }
}

/// Whether errors grow under all observers together and under none alone; growth that is rounding counts as none.
fn disagree(together: f64, alone: &[f64], rounding: f64) -> bool {
    together > rounding && alone.iter().all(|growth| *growth <= rounding)
}

/// Which common factor on the gains is stable, to begin a sentence.
fn remedy(linearised: &LinearisedSetup) -> String {
    match linearised.stable_share() {
        Ok(Some(share)) if share > 0.0 => format!(
            "lower one of the gains, or all of them: the largest common factor that is stable is {}; ",
            rounded_down(share)
        ),
        _ => "lower one of the gains: ".to_owned(),
    }
}

/// Three digits that are not above the value.
fn rounded_down(value: f64) -> f64 {
    let digit = 10_f64.powi(value.log10().floor() as i32 - 2);
    let down = (value / digit).floor() * digit;
    format!("{down:.3e}").parse().unwrap_or(down)
}

fn linearised(study: &Study) -> Result<LinearisedSetup, SpectrumError> {
    let medians = study.theta_for(0, posterior::prior(study).mean.as_slice());
    let model = study.setup.model().map_err(SpectrumError::from)?;
    LinearisedSetup::new(model, &study.setup, &medians, NATIVE)
}

#[cfg(test)]
mod tests {
    use super::{disagree, rounded_down};

    #[test]
    fn a_bound_is_never_rounded_up() {
        assert!((rounded_down(0.123_99) - 0.123).abs() < 1e-12);
        assert!((rounded_down(0.1) - 0.1).abs() < 1e-12 && rounded_down(0.1) <= 0.1);
    }

    #[test]
    fn only_growth_that_no_observer_has_alone_is_their_disagreement() {
        assert!(disagree(0.3, &[-1.0, 0.0], 1e-9));
        assert!(!disagree(-0.3, &[-1.0, -2.0], 1e-9));
        assert!(!disagree(1e-12, &[-1.0, -2.0], 1e-9), "rounding");
        assert!(!disagree(0.3, &[0.1, -2.0], 1e-9), "one grows by itself");
    }
}

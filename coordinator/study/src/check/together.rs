//! Whether several observers of a study go together: each state has one, and what is stable under each is stable under all.
//!
//! Both are judged at the prior medians, where `starlings spectrum` looks too. Next file to read: [`crate::spectrum`].

use starlings_models::catalogue::NATIVE;
use starlings_models::spectrum::{LinearisedSetup, SpectrumError};
use starlings_models::{BuildSetup, SOLVER};

use crate::file::ObserverSection;
use crate::problem::Source;
use crate::{Study, posterior};

/// Growth of the slowest error, in parts of the largest gain, that is rounding.
const ROUNDING: f64 = 1e-9;

/// Reports observers that correct the same state, or are unstable together though each is stable.
pub(super) fn check(source: &Source, section: &ObserverSection, study: &Study) {
    if section.beside.is_empty() || study.setup.model.kind == SOLVER {
        return;
    }
    let sections: Vec<&ObserverSection> = section.all().collect();
    // A model that no matrix describes where its runs start is told by `starlings spectrum`.
    let Ok(linearised) = linearised(study) else { return };
    if let Ok(Some((first, second, state))) = linearised.shared_state() {
        let (first, second) = (sections[first], sections[second]);
        source.report_with(
            second.kind.span(),
            format!(
                "the observers `{}` and `{}` both correct the state `{state}`",
                first.kind.get_ref(),
                second.kind.get_ref()
            ),
            "keep one of the two, or give them states of their own",
        );
        return;
    }
    let Ok((together, alone)) = linearised.together_and_alone() else { return };
    let largest = sections.iter().map(|one| *one.gain.get_ref()).fold(0.0, f64::max);
    if disagree(together, &alone, ROUNDING * largest) {
        let (name, unit) = (study.setup.observer.name(), &study.time_unit);
        source.report_with(
            section.kind.span(),
            format!(
                "the observers `{name}` are each stable and unstable together: the slowest error grows with {together:.3} 1/{unit}"
            ),
            "lower one of the gains: `starlings spectrum` shows the poles, with both gains in proportion",
        );
    }
}

/// Whether errors grow under all observers together and under none alone; growth that is rounding counts as none.
fn disagree(together: f64, alone: &[f64], rounding: f64) -> bool {
    together > rounding && alone.iter().all(|growth| *growth <= rounding)
}

fn linearised(study: &Study) -> Result<LinearisedSetup, SpectrumError> {
    let medians = study.theta_for(0, posterior::prior(study).mean.as_slice());
    let model = study.setup.model().map_err(SpectrumError::from)?;
    LinearisedSetup::new(model, &study.setup, &medians, NATIVE)
}

#[cfg(test)]
mod tests {
    use super::disagree;

    #[test]
    fn only_growth_that_no_observer_has_alone_is_their_disagreement() {
        assert!(disagree(0.3, &[-1.0, 0.0], 1e-9));
        assert!(!disagree(-0.3, &[-1.0, -2.0], 1e-9));
        assert!(!disagree(1e-12, &[-1.0, -2.0], 1e-9), "rounding");
        assert!(!disagree(0.3, &[0.1, -2.0], 1e-9), "one grows by itself");
    }
}

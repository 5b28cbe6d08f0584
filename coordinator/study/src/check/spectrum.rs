//! `[spectrum]`: names of observers, gains of at least zero, a decay in its range.
//!
//! Next file to read: [`crate::checked`].

use starlings_models::ObserverDef;
use starlings_models::spectrum::Decay;

use crate::checked::SpectrumChoice;
use crate::file::spectrum::{DecaySection, SpectrumSection};
use crate::problem::Source;
use crate::spectrum::observer_names;

/// `[spectrum]`.
pub(super) fn spectrum(source: &Source, section: &SpectrumSection, own: &ObserverDef) -> SpectrumChoice {
    let kinds = observer_names(own);
    for name in section.observers.iter().filter(|name| !kinds.contains(name.get_ref())) {
        source.report_unknown(name.span(), format!("unknown observer `{}`", name.get_ref()), &kinds);
    }
    for gain in section.gains.iter().filter(|gain| *gain.get_ref() < 0.0) {
        let message = format!("an observer's gain must not be negative, found {}", gain.get_ref());
        source.report_with(gain.span(), message, "0 shows the model without observer");
    }
    SpectrumChoice {
        observers: section.observers.iter().map(|name| name.get_ref().clone()).collect(),
        gains: section.gains.iter().map(|gain| *gain.get_ref()).collect(),
        decay: section.decay.as_ref().and_then(|decay| check_decay(source, decay)),
    }
}

fn check_decay(source: &Source, section: &DecaySection) -> Option<Decay> {
    let (factor, time) = (*section.factor.as_ref()?.get_ref(), *section.time.as_ref()?.get_ref());
    let decay = Decay::new(factor, time);
    if let Err(error) = &decay {
        source.report(section.span.clone(), error.to_string());
    }
    decay.ok()
}

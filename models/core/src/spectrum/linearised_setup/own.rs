//! The setup's own observers, one or several: what they are called, what they share, and which of their gains are stable together.
//!
//! Next file to read: [`super`].

use std::collections::BTreeMap;

use super::{LinearisedSetup, SpectrumError};
use crate::observer;
use crate::spectrum::observed::{Feedback, ObservedSystem};
use crate::{ObserverDef, SetupError, Spec};

/// Growth of the slowest error, in parts of the largest gain, that is rounding.
const ROUNDING: f64 = 1e-9;
/// Shares of the gains that are looked at for a stable one, and how many of them there are to the decade.
const SHARES: i32 = 180;
const PER_DECADE: f64 = 30.0;

impl LinearisedSetup {
    /// The names of the setup's own observers of a kind where it has several of them, else the kind.
    pub fn of_kind(&self, kind: &str) -> Vec<String> {
        let own = self.observer.all().zip(self.observer.names()).filter(|(def, _)| def.kind == kind);
        let names: Vec<String> = own.map(|(_, name)| name).collect();
        if names.len() > 1 { names } else { vec![kind.to_owned()] }
    }

    /// The definition of a kind, or of the setup's own observers by their joined name.
    pub(super) fn def(&self, kind: &str, gain: f64) -> ObserverDef {
        if !self.observer.beside.is_empty() && self.observer.name() == kind {
            return self.observer.at(gain);
        }
        let mut own = self.observer.all().zip(self.observer.names());
        if let Some((def, _)) = own.find(|(_, name)| name == kind) {
            return ObserverDef { gain, ..def.alone() };
        }
        let own = self.observer.all().find(|def| def.kind == kind);
        let own = own.or_else(|| (kind == "nudging").then_some(&self.observer));
        let corrects = own.map_or_else(BTreeMap::default, |def| def.corrects.clone());
        ObserverDef { kind: kind.to_owned(), gain, corrects, ..ObserverDef::default() }
    }

    /// Growth of the slowest error, in 1/time, up to which it counts as none.
    pub fn rounding(&self) -> f64 {
        ROUNDING * self.observer.all().map(|def| def.gain).fold(0.0, f64::max)
    }

    /// The largest real part of the poles under the setup's own observers, and under each of them alone at its gain, in 1/time.
    ///
    /// # Errors
    /// When the model cannot host one of them, or the poles are not found.
    pub fn together_and_alone(&self) -> Result<(f64, Vec<f64>), SpectrumError> {
        let largest = |def: &ObserverDef| {
            let matrix = &self.a - self.feedback(&*observer::build(def, self.wiring())?);
            ObservedSystem::new(&matrix, &Feedback::none(matrix.nrows()), self.negligible())?.max_re(0.0)
        };
        let alone = self.observer.all().map(|def| largest(&def.alone())).collect::<Result<_, _>>()?;
        Ok((largest(&self.observer)?, alone))
    }

    /// Two of the setup's own observers that correct one state, and that state.
    ///
    /// # Errors
    /// When the model cannot host one of them.
    pub fn shared_state(&self) -> Result<Option<(usize, usize, String)>, SetupError> {
        let all = self.observer.all().map(|def| observer::build(&def.alone(), self.wiring()));
        let all = all.collect::<Result<Vec<_>, _>>()?;
        let found = observer::shared_state(&all, &*self.model, &self.theta);
        Ok(found.map(|(i, j, at)| (i, j, Spec::component(&self.spec.states, at))))
    }

    /// The outputs that each of the setup's own observers corrects by; a field by its name.
    ///
    /// # Errors
    /// When the model cannot host one of them.
    pub fn outputs_read(&self) -> Result<Vec<Vec<String>>, SetupError> {
        let of_one = |def: &ObserverDef| {
            let rows = observer::build(&def.alone(), self.wiring())?.reads();
            observer::outputs_of(&self.spec, &self.outputs, &rows)
        };
        self.observer.all().map(of_one).collect()
    }

    /// The largest share of the gains of the setup's own observers, below one, with which no error grows under all of them together;
    /// `None` where none grows at the whole gains, 0 where one grows at every share down to a millionth.
    ///
    /// # Errors
    /// When the model cannot host one of them, or the poles are not found.
    pub fn stable_share(&self) -> Result<Option<f64>, SpectrumError> {
        let system = self.observed(&self.observer.name())?;
        let rounding = self.rounding();
        let is_stable =
            |share: f64| Ok::<_, SpectrumError>(system.max_re(share * self.observer.gain)? <= rounding);
        // From the whole gains down: the first that is stable lies below one that is not.
        let mut unstable = 1.0;
        for k in 0..=SHARES {
            let mut stable = 10_f64.powf(-f64::from(k) / PER_DECADE);
            if !is_stable(stable)? {
                unstable = stable;
                continue;
            }
            if k == 0 {
                return Ok(None);
            }
            while unstable / stable > 1.0 + 1e-9 {
                let middle = f64::midpoint(stable, unstable);
                if is_stable(middle)? { stable = middle } else { unstable = middle }
            }
            return Ok(Some(stable));
        }
        Ok(Some(0.0))
    }
}

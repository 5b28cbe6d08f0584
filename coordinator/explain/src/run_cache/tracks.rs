//! The courses of a model's states, outputs and inputs along the records.
//!
//! Next file to read: [`crate::run_cache`].

use std::sync::Arc;

use starlings_models::{SOLVER, Window};

use super::{Point, RunCache};
use crate::error::ExplainError;
use crate::locate::Track;

impl RunCache<'_> {
    /// The course of every scalar state and output of a variant, and of its inputs, at the times of the records. The states of an
    /// external solver are left out, because the solver does not show them.
    ///
    /// # Errors
    /// As [`RunCache::run`], and when the budget does not suffice for one point; a model that fails there gives no tracks.
    pub fn tracks(&mut self, point: &Point<'_>) -> Result<Vec<Track>, ExplainError> {
        if !self.affords(1) {
            return Err(self.beyond_budget(1));
        }
        let spec = &point.study.spec;
        let mut seen = point.study.clone();
        let states = spec.states.iter().filter(|_| point.study.setup.model.kind != SOLVER);
        let scalar = spec.outputs.iter().chain(states).filter(|q| q.size == 1);
        let mut names: Vec<(String, String)> = Vec::new();
        for quantity in scalar {
            if !names.iter().any(|(name, _)| *name == quantity.name) {
                names.push((quantity.name.clone(), quantity.unit.clone()));
            }
        }
        seen.setup.outputs = names.iter().map(|(name, _)| name.clone()).collect();
        let n_obs = names.len();
        let windows = self.windows.clone();
        for window in &mut self.windows {
            let observed = vec![f64::NAN; n_obs * window.times.len()];
            *window = Arc::new(Window { observed, ..Window::clone(window) });
        }
        let points = [Point { study: &seen, theta: point.theta.clone() }];
        // A model without a scalar state or output has tracks of its inputs only, which need no run.
        let runs = self.outputs(if names.is_empty() { &[] } else { &points });
        self.windows = windows;
        let mut tracks = Vec::new();
        let Ok(runs) = runs?.into_iter().collect::<Result<Vec<_>, String>>() else { return Ok(tracks) };
        for (i, (name, unit)) in names.into_iter().enumerate() {
            let values = runs.iter().map(|y| y.iter().skip(i).step_by(n_obs).copied().collect()).collect();
            tracks.push(Track { name, unit, values });
        }
        for (i, input) in spec.inputs.iter().enumerate() {
            let course =
                |window: &Arc<Window>| window.times.iter().map(|t| window.inputs[i].at(*t)).collect();
            let values = self.windows.iter().map(course).collect();
            if !tracks.iter().any(|t| t.name == input.name) {
                tracks.push(Track { name: input.name.clone(), unit: input.unit.clone(), values });
            }
        }
        Ok(tracks)
    }
}

//! What the store says of a run so far: parameters and innovations, analysis by analysis, read as they are committed.
//!
//! Bounded: where there are more than [`MOST`] points every other one is left out, so that a course of any length has the same cost.
//! Next file to read: [`mod@super::serve`].

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::json;
use starlings_study::store::{Store, StoreError};

use super::view::{ParameterView, View};

/// Points of a course at most.
pub const MOST: usize = 1200;
/// Parameters with a course at most; the others have their last value.
pub const DRAWN: usize = 12;
/// Rows of estimates that are read at a time.
const ROWS: usize = 20_000;

/// Parameters and innovations against analyses.
#[derive(Clone, Debug)]
pub struct Course {
    estimates_read: i64,
    analyses_read: i64,
    /// Time, observations and NIS of analyses whose estimates are not read yet.
    pending: BTreeMap<(i64, i64), (f64, i64, f64)>,
    points: Vec<Arc<str>>,
    /// Every so many analyses are a point.
    stride: u64,
    /// How often points were left out.
    generation: u64,
    n: u64,
    at: Option<(u64, u64)>,
    nis: Option<(f64, u64)>,
    last: Vec<ParameterView>,
}

impl Default for Course {
    fn default() -> Self {
        Self {
            estimates_read: 0,
            analyses_read: 0,
            pending: BTreeMap::new(),
            points: Vec::new(),
            stride: 1,
            generation: 0,
            n: 0,
            at: None,
            nis: None,
            last: Vec::new(),
        }
    }
}

/// An estimate with its place in the store.
struct Estimate {
    row: i64,
    key: (i64, i64),
    parameter: ParameterView,
}

impl Course {
    /// Reads what the store has gained. True where there is more than was read.
    ///
    /// # Errors
    /// When the store fails.
    pub fn read(&mut self, store: &Store) -> Result<bool, StoreError> {
        // In this order: an analysis is committed with its estimates, so those that are read have theirs.
        let select = format!(
            "SELECT rowid, pass, step, parameter, estimate, lo, hi FROM estimates WHERE rowid > {} ORDER BY rowid LIMIT {ROWS}",
            self.estimates_read
        );
        let mut estimates = store.rows(&select, |row| {
            let parameter =
                ParameterView { name: row.get(3)?, estimate: row.get(4)?, lo: row.get(5)?, hi: row.get(6)? };
            Ok(Estimate { row: row.get(0)?, key: (row.get(1)?, row.get(2)?), parameter })
        })?;
        if estimates.is_empty() {
            return Ok(false);
        }
        let is_cut = estimates.len() == ROWS;
        if is_cut {
            // The last analysis may be cut in two; it is read next time.
            let last = estimates.last().map(|estimate| estimate.key);
            let whole = estimates.iter().rposition(|estimate| Some(estimate.key) != last);
            estimates.truncate(whole.map_or(estimates.len(), |at| at + 1));
        }
        let select = format!(
            "SELECT rowid, pass, step, time, n_used, nis FROM analyses WHERE rowid > {} ORDER BY rowid",
            self.analyses_read
        );
        let analyses = store.rows(&select, |row| {
            Ok((row.get::<_, i64>(0)?, (row.get(1)?, row.get(2)?), (row.get(3)?, row.get(4)?, row.get(5)?)))
        })?;
        for (row, key, figures) in analyses {
            self.analyses_read = row;
            self.pending.insert(key, figures);
        }
        self.estimates_read = estimates.last().map_or(self.estimates_read, |estimate| estimate.row);
        for of_analysis in estimates.chunk_by(|a, b| a.key == b.key) {
            self.take(of_analysis);
        }
        Ok(is_cut)
    }

    /// Reads all that the store has.
    ///
    /// # Errors
    /// When the store fails.
    pub fn read_all(&mut self, store: &Store) -> Result<(), StoreError> {
        while self.read(store)? {}
        Ok(())
    }

    fn take(&mut self, estimates: &[Estimate]) {
        let Some(first) = estimates.first() else { return };
        let (pass, step) = first.key;
        let (time, n_used, nis) = self.pending.remove(&first.key).unwrap_or((f64::NAN, 0, f64::NAN));
        self.n += 1;
        self.at = Some((pass as u64, step as u64 + 1));
        self.nis = nis.is_finite().then_some((nis, n_used as u64));
        self.last = estimates.iter().map(|estimate| estimate.parameter.clone()).collect();
        if !self.n.is_multiple_of(self.stride) {
            return;
        }
        let drawn = self.last.iter().take(DRAWN);
        let bands: Vec<_> = drawn.map(|p| json!([p.estimate, p.lo, p.hi])).collect();
        self.points.push(json!([self.n, pass, step + 1, time, nis, n_used, bands]).to_string().into());
        if self.points.len() > MOST {
            let mut at = 0;
            // The first of the points has an odd place: those that stay lie on the coarser grid.
            self.points.retain(|_| {
                at += 1;
                at % 2 == 0
            });
            self.stride *= 2;
            self.generation += 1;
        }
    }

    /// Puts what is known now into a view.
    pub fn show(&self, view: &mut View) {
        view.analyses = self.n;
        view.at = self.at;
        view.nis = self.nis;
        view.parameters.clone_from(&self.last);
    }

    /// The points that somebody does not have who has so many of a generation: the generation, the place of the first one, and the
    /// points, each `[analysis, pass, step, time, NIS, observations, [[estimate, lo, hi], …]]`.
    pub fn since(&self, (generation, have): (u64, usize)) -> (u64, usize, &[Arc<str>]) {
        let from = if generation == self.generation { have.min(self.points.len()) } else { 0 };
        (self.generation, from, &self.points[from..])
    }

    /// Generation and number of points: what [`Course::since`] asks for.
    pub fn mark(&self) -> (u64, usize) {
        (self.generation, self.points.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimates(step: i64) -> [Estimate; 1] {
        let parameter = ParameterView { name: "R".to_owned(), estimate: step as f64, lo: 0.0, hi: 1e9 };
        [Estimate { row: step, key: (1, step), parameter }]
    }

    fn ordinals(points: &[Arc<str>]) -> Vec<u64> {
        let first = |point: &Arc<str>| point[1..].split(',').next().and_then(|n| n.parse().ok());
        points.iter().map(|point| first(point).expect("a number")).collect()
    }

    #[test]
    fn a_course_of_any_length_has_bounded_points_that_are_evenly_spaced() {
        let mut course = Course::default();
        for step in 0..100_000 {
            course.take(&estimates(step));
            assert!(course.points.len() <= MOST);
        }
        let (generation, from, points) = course.since((u64::MAX, 7));
        assert_eq!(from, 0);
        assert!(generation > 0 && points.len() > MOST / 2);
        let n = ordinals(points);
        assert!(n.windows(2).all(|pair| pair[1] - pair[0] == n[0]), "{n:?}");
        // The last value is exact, whatever was left out.
        let mut view = View::default();
        course.show(&mut view);
        assert_eq!((view.analyses, view.parameters[0].name.as_str()), (100_000, "R"));
        assert!((view.parameters[0].estimate - 99_999.0).abs() < 1e-9);
    }

    #[test]
    fn somebody_who_has_points_is_given_the_others() {
        let mut course = Course::default();
        for step in 0..10 {
            course.take(&estimates(step));
        }
        let mark = course.mark();
        for step in 10..13 {
            course.take(&estimates(step));
        }
        let (_, from, points) = course.since(mark);
        assert_eq!((from, ordinals(points)), (10, vec![11, 12, 13]));
    }
}

//! How like a term is to one that was named, along a run: whether it may stand in its place.
//!
//! Both count less what the fitted parameters change in the rate, which a refit gives to any term. Terms that are equal along the run
//! have equal influences; others have to be run. Next file to read: [`super::taken_up`].

use nalgebra::{DMatrix, DVector};
use starlings_models::effect::Addition;
use starlings_study::Record;

use super::taken_up::slopes;
use crate::fit::candidate::Candidate;
use crate::screen::along_run::{ReferenceRun, along_run};
use crate::screen::screening_result::IMITATED;

/// Steps of the record that are looked at, at most.
const STEPS: usize = 200;

/// What a named effect adds to the equation of a state.
pub(super) struct Likeness {
    record: usize,
    steps: Vec<usize>,
    /// Orthonormal columns of what the parameters change there.
    taken_up: DMatrix<f64>,
    /// The term less these, of length one.
    own: DVector<f64>,
}

impl Likeness {
    /// The term of an effect, with these values inside, in the first trained record. `None` where it adds to no state, or cannot be
    /// evaluated along the run.
    pub(super) fn new(run: &ReferenceRun<'_>, effect: (&Candidate, &[f64]), add: &Addition) -> Option<Self> {
        run.study.spec.states.iter().find(|q| q.name == add.to)?;
        let record = run.study.records.iter().position(Record::is_trained)?;
        let [from, to] = run.study.records[record].train_span()?;
        let times = &run.study.records[record].times;
        let trains: Vec<usize> = (0..times.len()).filter(|i| (from..=to).contains(&times[*i])).collect();
        let steps: Vec<usize> = trains.iter().copied().step_by(trains.len().div_ceil(STEPS).max(1)).collect();
        let term = along_run(run, effect.0, effect.1, &add.term, record, &steps)?;
        Self::of_courses(&slopes(run, &add.to, record, &steps), term).map(|(taken_up, own)| Self {
            record,
            steps,
            taken_up,
            own,
        })
    }

    /// What of a term is its own beside these courses, and an orthonormal basis of them.
    fn of_courses(taken_up: &[Vec<f64>], term: Vec<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = term.len();
        // One after the other, so that a course which repeats those before it adds no direction.
        let mut basis = DMatrix::zeros(n, 0);
        for course in taken_up {
            if let Some(further) = own(&basis, &DVector::from_column_slice(course)) {
                let at = basis.ncols();
                basis = basis.insert_column(at, 0.0);
                basis.set_column(at, &further);
            }
        }
        let own = own(&basis, &DVector::from_vec(term))?;
        Some((basis, own))
    }

    /// The size of the correlation of another term in that equation, at the point of its grid where it is largest; 0 where it cannot be
    /// evaluated.
    pub(super) fn of(&self, run: &ReferenceRun<'_>, other: &Candidate) -> f64 {
        let at = |point: &Vec<f64>| {
            let term = other.def.adds.first().map(|add| &add.term)?;
            let course = along_run(run, other, point, term, self.record, &self.steps)?;
            Some(own(&self.taken_up, &DVector::from_vec(course))?.dot(&self.own).abs())
        };
        other.points.iter().filter_map(at).fold(0.0, f64::max)
    }
}

/// A course less its part along an orthonormal basis, of length one; `None` where next to nothing is left of it, or no number.
fn own(basis: &DMatrix<f64>, course: &DVector<f64>) -> Option<DVector<f64>> {
    let own = course - basis * basis.tr_mul(course);
    let size = own.norm();
    (size > IMITATED * course.norm() && size.is_finite()).then(|| own / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Correlation of two functions of a swing, less what is in proportion to it.
    fn alike(a: fn(f64) -> f64, b: fn(f64) -> f64) -> f64 {
        let swing: Vec<f64> = (0..100).map(|k| (0.37 * f64::from(k)).sin()).collect();
        let (basis, of_a) =
            Likeness::of_courses(std::slice::from_ref(&swing), swing.iter().map(|s| a(*s)).collect())
                .unwrap();
        let of_b = DVector::from_iterator(100, swing.iter().map(|s| b(*s)));
        own(&basis, &of_b).unwrap().dot(&of_a).abs()
    }

    #[test]
    fn a_cube_is_like_a_square_with_a_sign_and_not_like_a_square() {
        // Of sin(x): the third harmonic is all of the cube, and of the square with a sign all but the fifth and higher, of a seventh of its size.
        assert!(alike(|s| s.powi(3), |s| s * s.abs()) > 0.98, "{}", alike(|s| s.powi(3), |s| s * s.abs()));
        assert!(alike(|s| s.powi(3), |s| s * s) < 0.1, "odd and even");
        assert!(
            alike(|s| s.powi(3), |s| s.powi(3) + 40.0 * s) > 1.0 - 1e-9,
            "the parameter takes up the rest"
        );
    }

    #[test]
    fn what_the_parameters_are_all_of_is_like_nothing_and_a_slope_that_stands_twice_counts_once() {
        let swing: Vec<f64> = (0..100).map(|k| (0.37 * f64::from(k)).sin()).collect();
        let cube: Vec<f64> = swing.iter().map(|s| s.powi(3)).collect();
        let twice = [swing.clone(), swing.iter().map(|s| 3.0 * s).collect()];
        let of = |taken_up: &[Vec<f64>], term: &[f64]| Likeness::of_courses(taken_up, term.to_vec());
        assert_eq!(of(&twice[..1], &twice[1]), None, "in proportion to the swing");
        let (once, twice) = (of(&twice[..1], &cube).unwrap(), of(&twice, &cube).unwrap());
        assert_eq!((once.0.ncols(), &once.1), (twice.0.ncols(), &twice.1));
    }

    #[test]
    fn a_course_that_is_no_number_is_like_nothing() {
        assert!(own(&DMatrix::zeros(2, 0), &DVector::from_vec(vec![1.0, f64::NAN])).is_none());
        assert!(own(&DMatrix::zeros(2, 0), &DVector::zeros(2)).is_none());
    }
}

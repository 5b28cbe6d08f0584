//! About how many bytes a run of a study writes, before it is made.
//!
//! Next file to read: [`crate::store`].

use starlings_estimators::{Form, SigmaSet};
use starlings_proto::MAX_INLINE_STATE;

use crate::Study;

/// Bytes of a row of the table of jobs, of estimates and of innovations, with their share of the file's structure.
const ROWS: [u64; 3] = [110, 130, 110];

/// Passes of a filter that goes on until it has settled; most do so sooner.
const PASSES: usize = 6;

impl Study {
    /// Bytes that a run writes, to within a factor of a few: rows of every analysis, the final predictions, and the states that a
    /// resume starts from, twice while they are replaced.
    pub fn bytes_of_a_run(&self) -> u64 {
        let p = self.theta.len();
        let particles = self.n_particle();
        let times: usize = self.records.iter().map(|record| record.times.len()).sum();
        let values = (times * self.setup.outputs.len()) as u64;
        let records = self.records.len();
        let (analyses, passes) = match self.estimator.kind.form {
            Form::Windows(_) => {
                let longest = (0..records).map(|record| self.windows(record).len()).max().unwrap_or(0);
                (longest, self.estimator.passes.unwrap_or(PASSES))
            }
            Form::WholeRecords(_) => (1, self.estimator.max_iterations),
        };
        let [job, estimate, innovation] = ROWS;
        let of_analysis = (particles * records) as u64 * job + p as u64 * estimate;
        let rows = (passes * analyses) as u64 * of_analysis + passes as u64 * values * innovation;
        rows + values * innovation + 2 * self.bytes_of_states()
    }

    /// Runs of an ensemble over a record.
    fn n_particle(&self) -> usize {
        let p = self.theta.len();
        if self.estimator.kind.has_exact_slopes() {
            return 1;
        }
        SigmaSet::new(self.estimator.points, p).map_or(p + 1, |set| set.n_particle())
    }

    /// Whether a state of the model travels by itself, in pieces.
    pub fn has_large_states(&self) -> bool {
        self.spec.n_state() * 8 > MAX_INLINE_STATE
    }

    /// Bytes of the states of all particles of all records.
    pub fn bytes_of_states(&self) -> u64 {
        (self.spec.n_state() * self.n_particle() * self.records.len() * 8) as u64
    }
}

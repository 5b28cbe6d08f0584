//! What the fitted parameters change in the rate of a state: as much of a missing term they have taken up.
//!
//! Next file to read: [`super::recovered`].

use nalgebra::DVector;

use crate::screen::along_run::{ReferenceRun, slope_along_run};

/// The derivatives of the rate of a state by the parameters at these steps of a record, one series for each that it depends on; none where
/// the model has no equations that can be read.
pub(super) fn slopes(run: &ReferenceRun<'_>, state: &str, record: usize, steps: &[usize]) -> Vec<Vec<f64>> {
    let equations = run.study.setup.model.equations.as_ref();
    let Some(of) = equations.and_then(|e| e.states.iter().find(|s| s.name == state)) else {
        return Vec::new();
    };
    let slope = |parameter: &String| {
        // A slope of which a part is not known is none.
        let sum = of.rate.iter().try_fold(DVector::zeros(steps.len()), |sum, (_, term)| {
            slope_along_run(run, term, parameter, record, steps).map(|slope| sum + DVector::from_vec(slope))
        })?;
        (sum.amax() > 0.0 && sum.iter().all(|v| v.is_finite())).then(|| sum.as_slice().to_vec())
    };
    run.study.setup.parameters.iter().filter_map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locate::Track;
    use starlings_study::Study;

    const STUDY: &str = r#"
[study]
name = "leak"
seed = 1

[model]
kind = "equations"
outputs = [{ name = "level", value = "h" }]
solver = { method = "fixed", step = 0.1 }

[[model.states]]
name = "h"
initial = 1.0
rate = { leak = "-k*sqrt(h)", pump = "q*k + q^2" }

[[parameters]]
name = "k"
prior = { transform = "linear", median = 1.0, sd = 0.1 }

[[parameters]]
name = "q"
prior = { transform = "linear", median = 1.0, sd = 0.1 }

[[parameters]]
name = "initial:h"
prior = { transform = "linear", median = 1.0, sd = 0.1 }

[[records]]
name = "run"
file = "data.csv"
channels = [{ column = "h", output = "level", noise = 0.1 }]

[estimator]
kind = "batch"
"#;

    #[test]
    fn the_slopes_of_a_rate_are_those_of_all_its_terms_by_every_parameter_that_it_reads() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("data.csv"), "time,h\n0,1\n1,1\n2,1\n").unwrap();
        std::fs::write(folder.path().join("study.toml"), STUDY).unwrap();
        let study = Study::load(&folder.path().join("study.toml")).unwrap();
        let level = vec![4.0, 1.0, 9.0];
        let track = Track { name: "h".to_owned(), unit: String::new(), values: vec![level] };
        let run = ReferenceRun { study: &study, theta: &[2.0, 3.0, 4.0], tracks: &[track] };
        // By k: q − √h; by q: k + 2 q; the initial value does not enter.
        assert_eq!(slopes(&run, "h", 0, &[0, 1, 2]), [vec![1.0, 2.0, 0.0], vec![8.0; 3]]);
        assert!(slopes(&run, "v", 0, &[0]).is_empty(), "no such state");
        let mut delayed = study.clone();
        let equations = delayed.setup.model.equations.as_mut().unwrap();
        equations.states[0].rate.push(("echo".to_owned(), "k*delay(h, 1)".to_owned()));
        let run = ReferenceRun { study: &delayed, ..run };
        // What k does through the delay is not known along the run, and so neither is what it does in all.
        assert_eq!(slopes(&run, "h", 0, &[0, 1, 2]), [vec![8.0; 3]]);
    }
}

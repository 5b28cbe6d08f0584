//! Quantities that nobody measured: how often the bands of `[predict]` hold the truth.

use starlings_coordinator::study::Study;
use starlings_coordinator::study::twin::{Recording, Twin, simulate};

use crate::systems::{System, TUBE};
use crate::tally;

/// The tube of examples/fsi-tube/hidden.toml, seen in five places, and the truth of everything.
pub(crate) struct Hidden {
    pub(crate) system: System,
    truth: Recording,
}

/// How often bands hold the truth.
#[derive(Default)]
pub(crate) struct Held {
    /// Output, values within its band, values in all.
    outputs: Vec<(String, usize, usize)>,
    /// Numbers over time (mean, lowest, highest) within their intervals, and all.
    pub(crate) figures: [usize; 2],
}

impl Hidden {
    pub(crate) fn tube() -> Self {
        let truth = [&TUBE[..], &[("R_d", 1850.0), ("C", 1e-3)]].concat();
        let system = System::of("hidden quantities", "fsi-tube/hidden.toml", &truth);
        let values = truth.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let truth = simulate(&system.study, &Twin { values, ..Twin::default() }).unwrap();
        Self { system, truth }
    }

    fn course(&self, study: &Study, output: &str) -> Vec<f64> {
        // What is no output of the model is the state of the Windkessel: p = π + R_p Q at the outlet.
        let column = |name: &str| {
            let at = self.truth.columns.iter().position(|column| column == name).unwrap();
            self.truth.values[at].clone()
        };
        if output == "pi" {
            let flow = column("outflow");
            return column("pressure").iter().zip(flow).map(|(p, q)| p - 150.0 * q).collect();
        }
        assert!(study.setup.outputs.iter().all(|measured| measured != output), "{output} is measured");
        column(output)
    }

    pub(crate) fn add(&self, seed: u64, held: &mut Held) {
        let study = self.system.drawn(seed);
        let done = tally::run(&study);
        for (course, output) in done.courses.iter().zip(&done.summary.predictions) {
            let truth = self.course(&study, &course.output);
            assert_eq!(truth.len(), course.time.len());
            let within = |k: &usize| (course.lo[*k]..=course.hi[*k]).contains(&truth[*k]);
            let inside = (0..truth.len()).filter(within).count();
            match held.outputs.iter_mut().find(|(name, _, _)| *name == course.output) {
                Some((_, n, all)) => (*n, *all) = (*n + inside, *all + truth.len()),
                None => held.outputs.push((course.output.clone(), inside, truth.len())),
            }
            let lowest = truth.iter().copied().fold(f64::INFINITY, f64::min);
            let highest = truth.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            for (value, figure) in [(lowest, output.lowest), (highest, output.highest)] {
                let [lo, hi] = figure.interval95;
                held.figures[0] += usize::from((lo..=hi).contains(&value));
                held.figures[1] += 1;
            }
        }
    }
}

impl Held {
    /// Share of all values within their bands.
    pub(crate) fn share(&self) -> f64 {
        let sum =
            |of: fn(&(String, usize, usize)) -> usize| self.outputs.iter().map(of).sum::<usize>() as f64;
        sum(|o| o.1) / sum(|o| o.2)
    }

    /// Rows of the table in docs/coverage.md.
    pub(crate) fn rows(&self) -> String {
        let row = |(name, inside, all): &(String, usize, usize)| {
            format!("| `{name}` | {:.3} |\n", *inside as f64 / *all as f64)
        };
        let figures = self.figures[0] as f64 / self.figures[1] as f64;
        let all = format!("| all | {:.3} |\n| lowest and highest values | {figures:.3} |", self.share());
        self.outputs.iter().map(row).chain([all]).collect()
    }
}

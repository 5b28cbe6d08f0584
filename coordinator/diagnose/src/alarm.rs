//! Whether a recording departs from the model without a fault, at the stated rate of false alarms.
//!
//! Half of the rate is for departures of any form, which say since when; half for the fits of the scenarios, which see a fault of their form
//! sooner than any other test. Next file to read: `departures.rs` of the estimators.

use starlings_estimators::departures::{Stretch, first_beyond, n_test, strongest};
use starlings_estimators::quantiles::chi_squared_tail;
use starlings_study::Study;

use crate::hypothesis::Hypothesis;
use crate::result::{AlarmFound, Departure, Matched};
use crate::runs::{Row, series};

/// What is compared: values by series.
pub(crate) struct Series<'a> {
    study: &'a Study,
    rows: &'a [Row],
    of: Vec<Vec<usize>>,
}

impl<'a> Series<'a> {
    pub(crate) fn new(study: &'a Study, rows: &'a [Row]) -> Self {
        Self { study, rows, of: series(rows) }
    }

    /// Rows of every series.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Vec<usize>> {
        self.of.iter()
    }

    /// Tests of all series together.
    fn n_test(&self) -> usize {
        self.of.iter().map(|of| n_test(of.len())).sum()
    }

    /// The first stretch that noise does not explain at this rate, in the order of the records.
    pub(crate) fn first(&self, innovations: &[f64], rate: f64) -> Option<Departure> {
        let level = rate / self.n_test().max(1) as f64;
        let found = self.each(innovations, |values| first_beyond(values, level));
        let order = |(of, stretch): &(&Vec<usize>, Stretch)| {
            let row = &self.rows[of[stretch.last]];
            (row.record, row.time)
        };
        let first = found.into_iter().min_by(|a, b| {
            let (a, b) = (order(a), order(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        first.map(|(of, stretch)| self.departure(of, stretch))
    }

    /// The stretch that noise explains least.
    pub(crate) fn strongest(&self, innovations: &[f64]) -> Option<Departure> {
        let found = self.each(innovations, strongest);
        let least = found.into_iter().min_by(|a, b| a.1.tail.total_cmp(&b.1.tail));
        least.map(|(of, stretch)| self.departure(of, stretch))
    }

    fn each(
        &self,
        innovations: &[f64],
        ask: impl Fn(&[f64]) -> Option<Stretch>,
    ) -> Vec<(&Vec<usize>, Stretch)> {
        let of_series = |of: &Vec<usize>| of.iter().map(|i| innovations[*i]).collect::<Vec<f64>>();
        self.of.iter().filter_map(|of| Some((of, ask(&of_series(of))?))).collect()
    }

    fn departure(&self, of: &[usize], stretch: Stretch) -> Departure {
        let [first, last] = [stretch.first, stretch.last].map(|k| &self.rows[of[k]]);
        Departure {
            record: self.study.records[first.record].name.clone(),
            output: self.study.setup.outputs[first.output].clone(),
            since: first.time,
            until: last.time,
            chi_squared: stretch.statistic,
            degrees: stretch.degrees,
            by_chance: (stretch.tail * self.n_test() as f64).min(1.0),
        }
    }
}

/// The alarm: `fits` are the scenarios by name with the number of their starts.
pub(crate) fn alarm(
    series: &Series<'_>,
    healthy: &Hypothesis<'_>,
    fits: &[(&str, usize, &Hypothesis<'_>)],
    rate: f64,
) -> AlarmFound {
    let innovations = healthy.innovations();
    let n_start: usize = fits.iter().map(|(_, n, _)| n).sum();
    let matched = |(name, _, fit): &(&str, usize, &Hypothesis<'_>)| {
        let chi_squared = healthy.cost() - fit.cost();
        let degrees = fit.z().len() - healthy.z().len();
        let by_chance = (chi_squared_tail(chi_squared, degrees as f64) * n_start as f64).min(1.0);
        Matched { scenario: (*name).to_owned(), chi_squared, degrees, by_chance }
    };
    let run = fits.iter().filter(|(_, _, fit)| fit.failure.is_none()).map(matched);
    AlarmFound {
        rate,
        seen: series.first(&innovations, 0.5 * rate),
        strongest: series.strongest(&innovations),
        matched: run
            .min_by(|a, b| a.by_chance.total_cmp(&b.by_chance).then(b.chi_squared.total_cmp(&a.chi_squared))),
    }
}

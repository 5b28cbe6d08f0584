//! The errors of a variant on data that no fit has seen, one channel of one record at a time.
//!
//! Held-out data *fail* where their error is larger than noise, chance and the uncertainty of the estimate explain together.
//! Which of those that fail forbid to name a variant, [`forbidding`] says.
//! Next files to read: [`super::gates`] for the gates, [`super::uncertainty`] for what the uncertainty explains.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use starlings_estimators::nis_band_of_uncertain_noise;

use super::adequacy::Adequacy;
use super::noise_model::LEAST;
use super::uncertainty::Uncertainty;
use crate::fit::fitted_variant::FittedVariant;
use crate::number::times;
use crate::rows::{Row, Rows, Usage};
use crate::run_cache::RunCache;

/// Root mean square over its expectation above which held-out data fail ...
const FAILS: f64 = 1.25;
/// ... and which must also lie outside the band of this probability, which is wider where the noise was found and not given.
const LEVEL: f64 = 0.9998;
/// What the uncertainty of the estimate explains is known to first order only: a rest below this share of it is no failure.
const FIRST_ORDER: f64 = 0.05;
/// Where the training residuals are no noise either, a variant must take away this share of the excess χ² of every held-out
/// channel of every record that fails ...
const SHARE_OF_EACH: f64 = 0.25;
/// ... and leave no more than this root mean square over the noise beyond the uncertainty of the estimate ...
pub(super) const FAR: f64 = 2.5;
/// ... unless the squares of its errors on a span of a fitted channel fell by this share: what it leaves there is the smaller part by far,
/// however well the noise lets it be seen. What the uncertainty of the estimate explains does not count here: it grows with what the fit
/// leaves. A channel that is never fitted excuses nothing.
const MOST: f64 = 0.75;
/// Channels that a sentence names at most.
const NAMED: usize = 3;

/// One channel of one record in data that no fit has seen. Sizes are root mean squares over the stated noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Record name.
    pub record: String,
    /// Output name.
    pub channel: String,
    /// `held-out` (span or record) or `held-out-channel`.
    #[serde(rename = "use")]
    pub usage: String,
    /// Number of values.
    pub n: usize,
    /// Error of the model as it is.
    pub before: f64,
    /// Error with the effects that were named or came nearest; that of the model as it is where there are none.
    pub after: f64,
    /// Part of the latter that the uncertainty of the estimate does not explain; one is expected of noise.
    pub beyond: f64,
    /// Whether that is more than noise explains.
    pub fails: bool,
    /// Share of the excess χ² that went away, with what the uncertainty of the estimate explains; 0 where there was no excess.
    pub mended: f64,
    /// The noise with which these data are compared, over the stated one.
    pub noise: f64,
}

impl HeldOut {
    /// Share of the mean square of the model's errors that went away.
    fn fell(&self) -> f64 {
        1.0 - (self.after / self.before).powi(2)
    }

    /// Channel and errors in words: `product (never fitted) at 4.60 times its noise, 4.21 times beyond the uncertainty of
    /// the estimate`.
    pub fn says(&self, several_records: bool) -> String {
        let what = if self.usage == Usage::HeldOutChannel.word() { "never fitted" } else { "held out" };
        let of = if several_records { format!(", {}", self.record) } else { String::new() };
        format!(
            "{} ({what}{of}) at {} its noise, {} beyond the uncertainty of the estimate",
            self.channel,
            times(self.after),
            times(self.beyond)
        )
    }
}

/// Every held-out channel of every record under a variant; `base` is the model as it is.
pub(crate) fn held_out(
    cache: &RunCache<'_>,
    base: &FittedVariant<'_>,
    fit: &FittedVariant<'_>,
) -> Vec<HeldOut> {
    let rows = &cache.rows;
    if fit.predicted.len() != rows.rows.len() {
        return Vec::new();
    }
    let levels = levels(rows, fit.residual(), &Adequacy::of(cache, fit));
    let (before, after) = (rows.whitened(&base.predicted), rows.whitened(&fit.predicted));
    let (scaled_before, scaled_after) = (rows.scaled(&base.predicted), rows.scaled(&fit.predicted));
    let uncertainty = Uncertainty::of(cache, fit);
    let one = |at: Vec<usize>| {
        let row: &Row = &rows.rows[at[0]];
        let n = at.len() as f64;
        let squares = |e: &[f64]| at.iter().map(|i| e[*i].powi(2)).sum::<f64>();
        let (was, is) = (squares(&before), squares(&after));
        let explained = uncertainty.as_ref().map_or(0.0, |of| of.allowance(&at, &after));
        let record = &cache.study.records[row.record];
        let beyond = (is - explained).max(0.0) / (n * levels[row.output]);
        HeldOut {
            record: record.name.clone(),
            channel: record.channels[row.channel].output.clone(),
            usage: row.usage.word().to_owned(),
            n: at.len(),
            before: (squares(&scaled_before) / n).sqrt(),
            after: (squares(&scaled_after) / n).sqrt(),
            beyond: beyond.sqrt(),
            fails: is_larger(beyond, at.len(), row.noise_freedom) && is - explained > FIRST_ORDER * explained,
            mended: if was > n { ((was - is + explained) / (was - n)).clamp(-1.0, 1.0) } else { 0.0 },
            noise: levels[row.output].sqrt(),
        }
    };
    groups(&rows.rows).into_iter().map(one).collect()
}

/// Whether a mean square of so many unseen values over the variance of the noise, which is known with this freedom, is more than chance leaves.
pub(super) fn is_larger(mean_square: f64, n: usize, freedom: f64) -> bool {
    mean_square > (FAILS * FAILS).max(nis_band_of_uncertain_noise(n, freedom, LEVEL).1)
}

/// The variance of the noise of every output, over the stated one, with which its held-out errors are compared: where the training
/// residuals could be white, the mean square of its own, or of all where too few of its values are fitted to tell, and at least the
/// stated one. An output whose sensor, or whose recorded input, is noisier than stated is so on either side of the training span.
fn levels(rows: &Rows, residual: &DVector<f64>, adequacy: &Adequacy) -> Vec<f64> {
    if !adequacy.could_be_white() {
        return vec![1.0; rows.n_output()];
    }
    let mut of_row = vec![0.0; rows.rows.len()];
    for (i, e) in rows.train.iter().zip(residual.iter()) {
        of_row[*i] = *e;
    }
    let of_all = adequacy.rmse_over_noise.powi(2);
    let own = rows.mean_squares(&of_row, LEAST, |_| true);
    own.into_iter().map(|square| square.unwrap_or(of_all).max(1.0)).collect()
}

/// Positions of the rows that no fit sees, by record, channel and use: what lies before the training span and what lies after
/// it are one.
fn groups(rows: &[Row]) -> Vec<Vec<usize>> {
    let key = |i: usize| (rows[i].record, rows[i].channel, rows[i].usage);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in (0..rows.len()).filter(|i| rows[*i].usage != Usage::Train) {
        match groups.iter_mut().find(|group| key(group[0]) == key(i)) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// The held-out data that forbid to name a variant. Where its training residuals are noise, these are all that fail, since no
/// remaining discrepancy of the training data could be their cause; otherwise those that the variant improves too little, which is more
/// where their error stays large.
pub(crate) fn forbidding<'h>(adequacy: &Adequacy, of: &'h [HeldOut]) -> Vec<&'h HeldOut> {
    let strict = adequacy.could_be_white();
    let is_span = |h: &HeldOut| h.usage == Usage::HeldOut.word();
    let far = |h: &HeldOut| h.beyond > FAR && !(is_span(h) && h.fell() >= MOST);
    of.iter().filter(|h| h.fails && (strict || h.mended < SHARE_OF_EACH || far(h))).collect()
}

/// The held-out data that do not speak for a variant, whatever the uncertainty of its estimate explains: their error is far from the noise, and
/// from what is left of the training rows where that is no noise.
pub(crate) fn far_off<'h>(adequacy: &Adequacy, of: &'h [HeldOut]) -> Vec<&'h HeldOut> {
    let left = if adequacy.could_be_white() { 1.0 } else { adequacy.rmse_over_noise };
    of.iter().filter(|h| h.after > FAR * h.noise.max(left)).collect()
}

/// Those that fail, the worst first, in words; empty without any.
pub(crate) fn listed(of: &[&HeldOut]) -> String {
    let mut worst: Vec<&&HeldOut> = of.iter().collect();
    worst.sort_by(|a, b| b.beyond.total_cmp(&a.beyond));
    let several = of.iter().any(|h| h.record != of[0].record);
    let mut words: Vec<String> = worst.iter().take(NAMED).map(|h| h.says(several)).collect();
    if of.len() > NAMED {
        words.push(format!("{} more", of.len() - NAMED));
    }
    words.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(after: f64, beyond: f64, mended: f64) -> HeldOut {
        HeldOut {
            record: "batch".to_owned(),
            channel: "product".to_owned(),
            usage: "held-out-channel".to_owned(),
            n: 100,
            before: 5.0,
            after,
            beyond,
            fails: beyond > FAILS,
            mended,
            noise: 1.0,
        }
    }

    fn residuals(rmse_over_noise: f64, p: f64) -> Adequacy {
        let inflation = if p < 1e-3 { 20.0 } else { 1.0 };
        Adequacy {
            n: 200,
            rmse_over_noise,
            whiteness: Some(p),
            inflation,
            over_spread: 0.1,
            noise_freedom: f64::INFINITY,
        }
    }

    #[test]
    fn a_name_is_withheld_while_anything_held_out_fails_and_the_training_residuals_are_noise() {
        let noise = residuals(1.0, 0.4);
        for (after, beyond, mended) in [(4.6, 4.2, 0.2), (4.6, 4.2, 0.95), (1.6, 1.5, 0.8)] {
            let all = [channel(after, beyond, mended)];
            assert_eq!(forbidding(&noise, &all).len(), 1, "{all:?}");
        }
        assert!(forbidding(&noise, &[channel(3.0, 1.1, 0.0)]).is_empty(), "the uncertainty explains it");
    }

    #[test]
    fn where_the_training_residuals_are_no_noise_what_falls_enough_does_not_withhold_the_name() {
        let correlated = residuals(0.8, 1e-9);
        assert!(forbidding(&correlated, &[channel(1.9, 1.7, 0.42)]).is_empty());
        assert_eq!(forbidding(&correlated, &[channel(1.9, 1.7, 0.1)]).len(), 1, "nothing improved it");
        assert_eq!(forbidding(&correlated, &[channel(4.6, 4.2, 0.6)]).len(), 1, "far from its noise");
        assert_eq!(
            forbidding(&correlated, &[channel(4.6, 4.2, 0.9)]).len(),
            1,
            "a channel that no fit has seen"
        );
        let span = |before: f64| HeldOut { usage: "held-out".to_owned(), before, ..channel(17.0, 15.0, 0.9) };
        assert!(forbidding(&correlated, &[span(60.0)]).is_empty(), "something smaller remains");
        assert_eq!(forbidding(&correlated, &[span(25.0)]).len(), 1, "its uncertainty excuses what it leaves");
    }

    #[test]
    fn what_lies_far_from_the_noise_and_from_what_was_fitted_does_not_speak_for_a_variant() {
        let span = [channel(9.0, 1.1, 0.99), channel(2.0, 1.1, 0.9)];
        assert_eq!(far_off(&residuals(1.2, 0.4), &span), [&span[0]]);
        assert!(far_off(&residuals(4.0, 1e-9), &span).is_empty(), "as far as the training rows");
        let noisy = [HeldOut { noise: 4.0, ..channel(9.0, 1.1, 0.99) }];
        assert!(far_off(&residuals(1.2, 0.4), &noisy).is_empty(), "an output noisier than stated");
    }

    #[test]
    fn what_is_held_out_of_an_output_is_compared_with_the_noise_that_its_own_training_rows_show() {
        let mut rows = Rows::sample(40, |_| Usage::Train);
        for (i, row) in rows.rows.iter_mut().enumerate() {
            row.output = i % 2;
        }
        rows.rows.push(Row { output: 2, usage: Usage::HeldOutChannel, ..rows.rows[0] });
        // One value of a fourth, far off, tells no noise.
        rows.rows.push(Row { output: 3, ..rows.rows[0] });
        rows.train.push(41);
        let residual = DVector::from_fn(41, |i, _| [1.4, 0.8, 4.0][if i == 40 { 2 } else { i % 2 }]);
        let noise = Adequacy { rmse_over_noise: 1.3_f64.sqrt(), ..residuals(1.0, 0.4) };
        let of = levels(&rows, &residual, &noise);
        // The second is quieter than stated, and the third is never fitted.
        assert!(
            of.len() == 4 && of.iter().zip([1.96, 1.0, 1.3, 1.3]).all(|(of, want)| (of - want).abs() < 1e-12),
            "{of:?}"
        );
        assert_eq!(
            levels(&rows, &residual, &residuals(1.1, 1e-9)),
            [1.0; 4],
            "correlated residuals are no noise"
        );
    }

    #[test]
    fn what_fails_is_said_with_its_figures_the_worst_first() {
        let mut all = [channel(4.6, 4.2, 0.2), channel(9.1, 8.05, 0.0)];
        all[1].usage = "held-out".to_owned();
        assert_eq!(
            listed(&all.iter().collect::<Vec<_>>()),
            "product (held out) at 9.10 times its noise, 8.05 times beyond the uncertainty of the estimate; product (never \
             fitted) at 4.60 times its noise, 4.20 times beyond the uncertainty of the estimate"
        );
        assert_eq!(listed(&[]), "");
    }
}

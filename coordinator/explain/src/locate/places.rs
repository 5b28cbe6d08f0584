//! The few places that hold most of the misfit, none listed twice.
//!
//! In every channel the best region is taken, its values are set aside, and the rest is searched again; what is then left
//! is a place of its own when it is still above what is expected. A channel whose misfit lies nowhere in particular is one
//! place. Next file to read: [`super::region`].

use starlings_estimators::effective_sample_size;

use super::View;
use super::bootstrap::{DRAWS, block_bootstrap_rms, block_length};
use super::region::{Region, best};
use super::residuals::Residuals;
use super::result::MisfitPlace;
use super::sentence::{Figures, region_words, sentence};
use super::signal::{Signal, signals};
use crate::rows::Usage;

/// Regions of one channel at most: where it trains, and where it is held out.
const MOST: (usize, usize) = (3, 1);
/// Log-likelihood ratio that a region must reach: the largest of the some ten thousand intervals that are tried reaches
/// 10 by chance. Correlated residuals count as fewer values, and then a smaller ratio suffices.
const LEAST_GAIN: (f64, f64) = (12.0, 1.5);
/// Smallest share of independent values that correlated residuals are taken to amount to.
const LEAST_EFFECTIVE: f64 = 0.03;
/// Share of the misfit that a region must hold beyond its share of the values.
const CONCENTRATION: f64 = 0.15;
/// Ratio to the expected root mean square from which a place is listed.
const WORSE: f64 = 1.06;
/// How many sd of a chi-square the squares must exceed their expectation.
const SURE: f64 = 4.0;
/// Share of the channel's misfit below which the rest beside other places is not listed.
const REST: f64 = 0.1;

/// A place with its rank.
struct Ranked {
    place: MisfitPlace,
    usage: Usage,
    /// Sum over the values of squared residual over expected square, less one.
    excess: f64,
}

/// Places of all channels: training values first, then held-out ones, worst first.
pub(super) fn places(view: &View<'_>, groups: &[Residuals]) -> Vec<MisfitPlace> {
    let mut ranked: Vec<Ranked> = groups.iter().flat_map(|group| of_channel(view, group)).collect();
    let order = |usage: Usage| match usage {
        Usage::Train => 0,
        Usage::HeldOut => 1,
        Usage::HeldOutChannel => 2,
    };
    ranked.sort_by(|a, b| order(a.usage).cmp(&order(b.usage)).then(b.excess.total_cmp(&a.excess)));
    ranked.into_iter().map(|r| r.place).collect()
}

fn of_channel(view: &View<'_>, group: &Residuals) -> Vec<Ranked> {
    let e = group.standardised();
    let mut open = vec![true; group.len()];
    let excess: f64 = e.iter().map(|e| e * e - 1.0).sum();
    if excess <= 0.0 {
        return Vec::new();
    }
    let signals = signals(view.tracks, view.study, group);
    let independent = (effective_sample_size(&e) / e.len() as f64).clamp(LEAST_EFFECTIVE, 1.0);
    let mut found: Vec<Ranked> = Vec::new();
    let most = if group.usage == Usage::Train { MOST.0 } else { MOST.1 };
    while found.len() < most {
        let Some((region, concentration)) = best(&signals, &e, &open) else { break };
        let clear = region.gain > LEAST_GAIN.0 && region.gain * independent > LEAST_GAIN.1;
        if !clear || concentration < CONCENTRATION {
            break;
        }
        let inside: Vec<usize> = (0..e.len()).filter(|i| open[*i] && region.holds(&signals, *i)).collect();
        let Some(ranked) = ranked(view, group, &inside, Some((&region, &signals)), false) else { break };
        for i in inside {
            open[i] = false;
        }
        found.push(ranked);
    }
    let rest: Vec<usize> = (0..e.len()).filter(|i| open[*i]).collect();
    let left = ranked(view, group, &rest, None, !found.is_empty());
    found.extend(left.filter(|l| found.is_empty() || l.excess > REST * excess));
    found
}

/// The place of these values; `None` where they are not significantly worse than expected.
fn ranked(
    view: &View<'_>,
    group: &Residuals,
    inside: &[usize],
    region: Option<(&Region, &[Signal])>,
    elsewhere: bool,
) -> Option<Ranked> {
    let n = inside.len() as f64;
    let values: Vec<f64> = inside.iter().map(|i| group.value[*i]).collect();
    let squares: f64 = inside.iter().map(|i| group.value[*i].powi(2) / group.variance[*i]).sum();
    let expected = (inside.iter().map(|i| group.variance[*i]).sum::<f64>() / n).sqrt();
    let rmse = (values.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let interval95 = block_bootstrap_rms(&values, block_length(&values), DRAWS, view.seed);
    let sure = (squares / n - 1.0) * (0.5 * n).sqrt() > SURE;
    if !(sure && rmse > WORSE * expected && interval95[0] > expected) {
        return None;
    }
    let bias = values.iter().sum::<f64>() / n;
    let figures = Figures { rmse, expected, bias, share: n / group.len() as f64 };
    let times = || inside.iter().map(|i| group.time[*i]);
    let several = group.record.first() != group.record.last();
    let region_text = match region {
        Some((region, signals)) => region_words(region, signals, several),
        None if elsewhere => "elsewhere".to_owned(),
        None => String::new(),
    };
    let place = MisfitPlace {
        channel: group.channel.clone(),
        unit: group.unit.clone(),
        from: times().fold(f64::INFINITY, f64::min),
        to: times().fold(f64::NEG_INFINITY, f64::max),
        region: region_text,
        rmse,
        interval95,
        expected,
        sentence: sentence(group, region, elsewhere, &figures),
    };
    Some(Ranked { place, usage: group.usage, excess: squares - n })
}

//! Where a fit stands that has not converged, and what may keep it from that.
//!
//! Next file to read: [`super::words`].

use starlings_estimators::correlation;
use starlings_study::{CORRELATED, ThetaEntry, posterior};

use crate::fit::fitted_variant::FittedVariant;
use crate::number::factor;

/// Standard deviations of its prior beyond which the data have pulled a parameter to where nobody expected it.
const AWAY: f64 = 5.0;

/// Where a fit stands that has not converged.
pub(crate) fn stand(fit: &FittedVariant<'_>) -> String {
    let n = fit.residual().len().max(1) as f64;
    let rms = (fit.residual().norm_squared() / n).sqrt();
    let theta = &fit.variant.study.theta;
    let why = ran_away(theta, fit.theta().as_slice()).or_else(|| exchanged(fit));
    format!("{} (root mean square residual {} noise sd){}", values(fit), factor(rms), why.unwrap_or_default())
}

/// The parameter that is furthest from its prior, where it is far away: the others then stand where it leaves them.
fn ran_away(theta: &[ThetaEntry], at: &[f64]) -> Option<String> {
    let away = theta.iter().zip(at).map(|(t, at)| (((at - t.prior_mean) / t.prior_sd).abs(), &t.name));
    let (sds, name) = away.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(sds, _)| *sds > AWAY)?;
    Some(format!(
        ", where the data pull `{name}` {} standard deviations away from its prior: if it cannot be there, look for another unit or sign in \
         the data, a wrong start, or an effect that it stands in for",
        factor(sds)
    ))
}

/// The two parameters that stand in for each other most, where they do.
fn exchanged(fit: &FittedVariant<'_>) -> Option<String> {
    let optimum = fit.optimum().ok()?;
    let theta = &fit.variant.study.theta;
    let correlation = correlation(optimum.covariance());
    let pairs = (0..correlation.nrows()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let strength = |(i, j): &(usize, usize)| correlation[(*i, *j)].abs();
    let strong = pairs.filter(|pair| strength(pair) > CORRELATED);
    let (i, j) = strong.max_by(|a, b| strength(a).total_cmp(&strength(b)))?;
    let value = correlation[(i, j)];
    Some(format!(
        ", where {} and {} stand in for each other (correlation {value:.4}): fix one or give it a narrower prior",
        theta[i].name, theta[j].name
    ))
}

/// The posterior's names and values in words.
fn values(fit: &FittedVariant<'_>) -> String {
    let theta = fit.theta();
    let zero = vec![0.0; theta.len()];
    let gaussian = posterior::independent(theta.as_slice(), &zero);
    let estimates = posterior::estimates(&fit.variant.study, &gaussian);
    estimates.iter().map(|e| format!("{} = {:.5}", e.name, e.estimate)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use starlings_estimators::{Drift, Transform};

    use super::*;

    #[test]
    fn the_parameter_that_left_its_prior_is_told_and_none_that_stays_near_it() {
        let entry = |name: &str, prior_mean: f64, prior_sd: f64| ThetaEntry {
            name: name.to_owned(),
            parameter: 0,
            record: None,
            prior_mean,
            prior_sd,
            transform: Transform::Linear,
            drift: Drift::None,
        };
        let theta = [entry("R", 1.0, 0.5), entry("C", 2.0, 0.1), entry("L", 0.0, 1.0)];
        assert_eq!(ran_away(&theta, &[3.4, 1.6, -4.9]), None);
        let told = ran_away(&theta, &[3.6, 1.0, -4.9]).expect("C is far away");
        assert!(told.contains("`C` 10.00 standard deviations away from its prior"), "{told}");
    }
}

//! The uncertainty of an estimate given the residuals that it leaves, whatever noise was stated.
//!
//! An estimate moves with the errors e of the data as A e, A = H^-1 J^T W^-1/2: its covariance is the sandwich
//! H^-1 (P0^-1 + S) H^-1, P0^-1 the prior's precision and S the covariance of the summed scores J^T W^-1/2 e (Huber 1967; White
//! 1980). With white errors of the stated size S is the data's information and the sandwich is H^-1; with errors that are
//! larger or correlated it is wider. S is estimated from the residuals in two ways, and the larger counts, parameter by
//! parameter: `scores.rs` assumes of the errors only that they are stationary beyond the record, and is imprecise when they
//! stay correlated over a good part of it; `working.rs` is precise there, because it assumes how the correlation falls. Where
//! the errors are likely white the cosines of `scores.rs` are left out, since the sum of squares estimates the variance of
//! white scores more precisely. The result is never narrower than the interval at the stated noise, up to which the estimate
//! itself is computed. Errors that repeat with the input, and so look like an effect of the parameters, leave no residual and
//! are not covered. Read next: `scores.rs`.

#[cfg(test)]
mod alternatives;
mod scores;
#[cfg(test)]
mod tests;
mod working;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::EstimatorError;
use crate::data::same;

/// Residuals beyond the number of parameters below which no factor is given.
const FEWEST: usize = 8;

/// Where an observed value stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataPoint {
    /// Number of its record; records are independent.
    pub record: usize,
    /// Its time.
    pub time: f64,
    /// Number of its channel.
    pub channel: usize,
}

/// A fit at its estimate: residuals and their slope. m observed values, p parameters in units of their prior sd.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// d prediction / d parameter over the noise sd, m x p.
    pub jacobian: &'a DMatrix<f64>,
    /// Observed minus predicted over the noise sd, length m.
    pub values: &'a DVector<f64>,
    /// Where they stand, length m: records one after the other, times increasing within each.
    pub places: &'a [DataPoint],
}

impl Residuals<'_> {
    /// Factor by which the sd of each parameter at the stated noise grows with the residuals, at least one, length p; it holds
    /// the Student t quantile of the few numbers that it rests on, so that 1.96 of the product is the half-width of a 95 %
    /// interval. `None` when there are fewer than eight residuals more than parameters.
    ///
    /// # Errors
    /// `Shape`; `NotFinite` for residuals or slopes that are no finite numbers.
    pub fn inflation(&self) -> Result<Option<Vec<f64>>, EstimatorError> {
        let (m, p) = self.jacobian.shape();
        same("residuals of the fit", m, self.values.len())?;
        same("places of the residuals", m, self.places.len())?;
        let all = self.jacobian.iter().chain(self.values.iter());
        if all.chain(self.places.iter().map(|place| &place.time)).any(|v| !v.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "a residual or its slope" });
        }
        if m < p + FEWEST {
            return Ok(None);
        }
        let influence = Influence::new(self.jacobian)?;
        let records = self.records(&influence);
        let lost = m as f64 / (m as f64 - influence.basis.norm_squared()).max(1.0);
        let mut variance = DVector::<f64>::zeros(p);
        let working = working::working(&records);
        for j in 0..p {
            let of_records: Vec<Vec<f64>> = records.iter().map(|record| record.scores(j)).collect();
            let correlated = lost * scores::variance(&of_records);
            variance[j] = working.as_ref().map_or(correlated, |working| {
                // Likely white: the cosines are left out, since the sum of squares estimates the variance of white scores more
                // precisely.
                let alike = working.variance[j];
                let expected = records.iter().flat_map(|record| record.expected(j));
                let white = scores::uneven(&of_records, expected).map_or(alike, |of_white| lost * of_white);
                alike.max(working.white * white + (1.0 - working.white) * correlated)
            });
        }
        let inflation = (0..p).map(|j| {
            let ratio = (variance[j] + influence.of_prior[j]) / influence.variance[j];
            if ratio.is_finite() { ratio.sqrt().max(1.0) } else { 1.0 }
        });
        Ok(Some(inflation.collect()))
    }

    /// The rows of each record by channel.
    fn records(&self, influence: &Influence) -> Vec<Record> {
        let mut records = Vec::new();
        let mut first = 0;
        for of_record in self.places.chunk_by(|a, b| a.record == b.record) {
            let rows = first..first + of_record.len();
            let mut times: Vec<f64> = of_record.iter().map(|place| place.time).collect();
            times.dedup();
            let mut channels: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
            for k in rows.clone() {
                channels.entry(self.places[k].channel).or_default().push(k);
            }
            let series = channels.values().map(|own| Series {
                step: own.iter().map(|k| times.partition_point(|t| *t < self.places[*k].time)).collect(),
                time: own.iter().map(|k| self.places[*k].time).collect(),
                residual: own.iter().map(|k| self.values[*k]).collect(),
                basis: influence.basis.select_rows(own),
                influence: influence.rows.select_rows(own),
            });
            records.push(Record { n_time: times.len(), series: series.collect() });
            first = rows.end;
        }
        records
    }
}

/// How the estimate answers to each observed value.
struct Influence {
    /// A^T, m x p: what an error of one noise sd in a row moves each parameter by, in prior sd.
    rows: DMatrix<f64>,
    /// Orthonormal basis of what the parameters and their prior imitate, the rows of the data, m x p.
    basis: DMatrix<f64>,
    /// Diagonal of H^-1, length p.
    variance: DVector<f64>,
    /// Diagonal of H^-1 P0^-1 H^-1, length p.
    of_prior: DVector<f64>,
}

impl Influence {
    /// By QR of the prior's rows and the Jacobian, (1; J) = Q R.
    fn new(jacobian: &DMatrix<f64>) -> Result<Self, EstimatorError> {
        let (m, p) = jacobian.shape();
        let mut rows = DMatrix::identity(p + m, p);
        rows.view_mut((p, 0), (m, p)).copy_from(jacobian);
        let qr = rows.qr();
        let basis = qr.q().rows(p, m).into_owned();
        let inverse = qr.unpack_r().solve_upper_triangular(&DMatrix::identity(p, p));
        let inverse = inverse.ok_or(EstimatorError::NotPositiveDefinite { what: "posterior" })?;
        let covariance = &inverse * inverse.transpose();
        Ok(Self {
            rows: &basis * inverse.transpose(),
            basis,
            of_prior: DVector::from_fn(p, |j, _| covariance.row(j).norm_squared()),
            variance: covariance.diagonal(),
        })
    }
}

/// The residuals of one record.
struct Record {
    /// Observation times at which any channel was observed.
    n_time: usize,
    /// One series per channel.
    series: Vec<Series>,
}

impl Record {
    /// The scores of parameter `j`: by how much the errors at each time move it, all channels together.
    fn scores(&self, j: usize) -> Vec<f64> {
        let mut scores = vec![0.0; self.n_time];
        for series in &self.series {
            for (k, step) in series.step.iter().enumerate() {
                scores[*step] += series.influence[(k, j)] * series.residual[k];
            }
        }
        scores
    }

    /// Variances of the scores of parameter `j` for white errors of one noise sd, by time.
    fn expected(&self, j: usize) -> Vec<f64> {
        let mut variances = vec![0.0; self.n_time];
        for series in &self.series {
            for (k, step) in series.step.iter().enumerate() {
                variances[*step] += series.influence[(k, j)].powi(2);
            }
        }
        variances
    }
}

/// The residuals of one channel of one record, n of them.
struct Series {
    /// Number of each observation time in its record.
    step: Vec<usize>,
    time: Vec<f64>,
    residual: Vec<f64>,
    /// Rows of [`Influence::basis`], n x p.
    basis: DMatrix<f64>,
    /// Rows of [`Influence::rows`], n x p.
    influence: DMatrix<f64>,
}

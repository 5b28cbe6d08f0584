//! The reduced-order unscented Kalman filter as pure steps on particles (Moireau & Chapelle 2011).
//!
//! The steps are those of [`Filter`]; what they have in common with one another is the geometry of the sigma points
//! (`particles.rs`). Deliberately no loop: the caller runs the model between two steps. Read next: `analysis.rs`.

use nalgebra::{DMatrix, DVector};

use crate::analysis::analyse;
use crate::data::same;
use crate::particles::{Geometry, SPANNED};
use crate::{
    Analysis, Data, Drift, EstimatorError, Filter, Form, Gaussian, Kind, Particles, Resampled, SigmaSet,
    drift, spectral,
};

/// The reduced-order unscented Kalman filter.
pub static ROUKF: Kind = Kind {
    name: "roukf",
    keys: &["points", "kappa", "spread", "passes", "anneal", "root", "resample"],
    spread: 0.001,
    form: Form::Windows(|o| {
        let set = SigmaSet::new(o.points, o.n_param)?;
        Ok(Box::new(Roukf { set, root: o.root }))
    }),
};

/// Which root C of the posterior covariance U^{-1} moves the particles; mean and covariance do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Root {
    /// Symmetric root: does not depend on the orientation or order of the points, and moves them least.
    #[default]
    Symmetric,
    /// Lower Cholesky factor (Moireau & Chapelle 2011).
    Cholesky,
}

/// The reduced-order unscented Kalman filter of p parameters with r particles.
#[derive(Debug, Clone, PartialEq)]
pub struct Roukf {
    /// Sigma points, r of them.
    pub set: SigmaSet,
    /// Root of the posterior covariance.
    pub root: Root,
}

impl Filter for Roukf {
    fn n_particle(&self) -> usize {
        self.set.n_particle()
    }

    fn weights(&self) -> &DVector<f64> {
        &self.set.weights
    }

    /// Particles that represent the prior exactly: mean + L I with L L^T its covariance.
    fn init(&self, prior: &Gaussian) -> Particles {
        assert_eq!(prior.n_param(), self.set.n_param(), "prior and sigma points differ in parameters");
        Particles::whole(around(&prior.mean, &(prior.factor() * &self.set.points)))
    }

    fn gaussian(&self, p: &Particles) -> Gaussian {
        let geometry = Geometry::new(&self.set, &p.pull);
        let l = &p.theta * &geometry.slope;
        Gaussian { mean: &p.theta * &geometry.mean, covariance: &l * l.transpose() }
    }

    fn pull(&self, p: &Particles, i: usize, s: f64) -> (Particles, DMatrix<f64>) {
        assert!(s > 0.0 && s <= 1.0, "a particle is pulled to a distance in (0, 1], got {s}");
        let geometry = Geometry::new(&self.set, &p.pull);
        let r = self.set.n_particle();
        let mut m = DMatrix::identity(r, r);
        if p.pull[i] > 0.0 {
            let kept = s / p.pull[i];
            m.set_column(i, &(&geometry.mean * (1.0 - kept)));
            m[(i, i)] += kept;
        } else {
            // A dropped particle is put on the line from the mean that the regression over the others gives.
            m.set_column(i, &(&geometry.mean + &geometry.slope * self.set.points.column(i) * s));
        }
        let mut pull = p.pull.clone();
        pull[i] = s;
        (Particles { theta: &p.theta * &m, pull }, m)
    }

    fn drop(&self, p: &Particles, i: usize) -> Result<Particles, EstimatorError> {
        let mut pull = p.pull.clone();
        pull[i] = 0.0;
        self.spanned(p, &Geometry::new(&self.set, &pull))?;
        Ok(Particles { theta: p.theta.clone(), pull })
    }

    fn resamples(&self) -> bool {
        self.set.n_particle() > self.set.n_param() + 1
    }

    /// Keeps the p leading directions of the whole spread of the augmented particles, its even part included, so that with as
    /// many parameters as states the filter is the plain unscented one.
    ///
    /// Up to 2 p directions spread, of which p are kept; what the others held is reported. Particles that were pulled or
    /// dropped, and the simplex, are left as they are (R = 1): a pulled set has no even part that could be trusted.
    fn resample(&self, p: &Particles, gram: &DMatrix<f64>) -> Result<Resampled, EstimatorError> {
        let (n_param, r) = (self.set.n_param(), self.set.n_particle());
        self.check(p)?;
        same("rows of the Gram matrix", r, gram.nrows())?;
        same("columns of the Gram matrix", r, gram.ncols())?;
        if gram.iter().any(|v| !v.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "the Gram matrix of the particles" });
        }
        if r == n_param + 1 || p.pull.iter().any(|s| *s < 1.0) {
            return Ok(Resampled::unchanged(p, r));
        }
        let eigen = spectral::eigen((gram + gram.transpose()) * 0.5, "Gram")?;
        let mut order: Vec<usize> = (0..r).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let whole: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum();
        let kept: f64 = order[..n_param].iter().map(|&i| eigen.eigenvalues[i].max(0.0)).sum();
        let dropped = if whole > 0.0 { (1.0 - kept / whole).max(0.0) } else { 0.0 };
        let leading = eigen.eigenvectors.select_columns(&order[..n_param]);
        let alpha = &self.set.weights;
        let mut directions = DMatrix::from_diagonal(&alpha.map(f64::sqrt)) * leading;
        for mut column in directions.column_iter_mut() {
            let sum = column.sum();
            column.axpy(-sum, alpha, 1.0);
        }
        let t = around(alpha, &(directions * &self.set.points));
        Ok(Resampled { particles: Particles::whole(&p.theta * &t), transform: t, dropped })
    }

    /// Without any observation a simplex stays where it is; other sets lose the even part of their spread (they are
    /// projected on the linear relation, w = 0 and C = 1).
    fn analysis(
        &self,
        p: &Particles,
        predictions: &DMatrix<f64>,
        data: &Data<'_>,
    ) -> Result<(Particles, Analysis), EstimatorError> {
        self.check(p)?;
        same("rows of the predictions", data.values.len(), predictions.nrows())?;
        same("columns of the predictions", self.set.n_particle(), predictions.ncols())?;
        let geometry = Geometry::new(&self.set, &p.pull);
        self.spanned(p, &geometry)?;
        let analysis = analyse(&geometry, &self.set.points, self.root, predictions, data)?;
        Ok((Particles::whole(&p.theta * &analysis.transform), analysis))
    }

    /// Random walks go on without any observation, forgetting waits for data.
    fn drift(
        &self,
        p: &Particles,
        drift: &[Drift],
        has_data: bool,
    ) -> Result<Option<DMatrix<f64>>, EstimatorError> {
        self.check(p)?;
        drift::check(drift, self.set.n_param())?;
        drift::transform(drift, &self.set, &p.theta, has_data)
    }

    fn directions(&self, p: &Particles, values: &DMatrix<f64>) -> DMatrix<f64> {
        values * Geometry::new(&self.set, &p.pull).slope
    }

    fn reduced(&self, p: &Particles, t: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let points = Geometry::new(&self.set, &p.pull).points * t;
        // Afterwards no particle is pulled any more.
        let whole = Geometry::new(&self.set, &vec![1.0; p.pull.len()]);
        (&points * whole.mean, &points * whole.slope)
    }
}

impl Roukf {
    /// Mean of the parameters, length p.
    ///
    /// # Panics
    /// When the particles do not match the sigma points in number.
    pub fn mean(&self, p: &Particles) -> DVector<f64> {
        &p.theta * Geometry::new(&self.set, &p.pull).mean
    }

    fn check(&self, p: &Particles) -> Result<(), EstimatorError> {
        same("parameters of the particles", self.set.n_param(), p.theta.nrows())?;
        same("particles", self.set.n_particle(), p.theta.ncols())?;
        same("pulls of the particles", self.set.n_particle(), p.pull.len())
    }

    /// Do the particles that count still span the parameters?
    fn spanned(&self, p: &Particles, geometry: &Geometry) -> Result<(), EstimatorError> {
        let (direction, variance) = &geometry.weakest;
        if *variance > SPANNED {
            return Ok(());
        }
        // The lost direction in parameters, each measured in its own sd, from the full set of points.
        let l = &p.theta * Geometry::new(&self.set, &vec![1.0; p.pull.len()]).slope;
        let lost = &l * direction;
        let share: Vec<f64> = (0..lost.len()).map(|j| (lost[j] / l.row(j).norm()).abs()).collect();
        let most = share.iter().copied().fold(0.0, f64::max);
        let mut parameters: Vec<usize> = (0..share.len()).filter(|&j| share[j] >= 0.5 * most).collect();
        parameters.sort_by(|a, b| share[*b].total_cmp(&share[*a]));
        let n_left = geometry.weights.iter().filter(|w| **w > 0.0).count();
        Err(EstimatorError::NotSpanned { n_left, n_param: share.len(), parameters })
    }
}

/// centre 1^T + offsets.
fn around(centre: &DVector<f64>, offsets: &DMatrix<f64>) -> DMatrix<f64> {
    let mut points = offsets.clone();
    for mut column in points.column_iter_mut() {
        column += centre;
    }
    points
}

//! Gauss–Newton with the model's own derivatives: the batch fit whose sigma points need no runs.
//!
//! Where the slope at the centre is known, what a sigma point would predict of the linear model is a sum; the regression of the batch fit
//! gives the slope back, whatever the points and their width. So both fits are one: the same steps, damping and end.
//! Where steps are rejected again and again the batch fit measures the slope anew with closer points; here it comes out the same. Read next: `batch.rs`.

use nalgebra::{DMatrix, DVector};

use crate::{Batch, BatchState, Form, Kind, Slope};

/// Gauss–Newton with exact slopes.
pub static GAUSS_NEWTON: Kind = Kind {
    name: "gauss-newton",
    keys: &["max_iterations", "tolerance"],
    // Of what is found beside the fit by differences, such as identifiability.
    spread: 0.001,
    form: Form::WholeRecords(Slope::Exact),
};

impl Batch {
    /// Transformed parameters of the next centre, length p.
    pub fn centre(&self, s: &BatchState) -> DVector<f64> {
        &s.prior.mean + s.prior.factor() * &s.trial
    }

    /// What the ensemble of [`Batch::sample`] predicts where the model is linear, m x (r+1): `centre` at its centre, m, and the slope there by
    /// the transformed parameters, m x p.
    pub fn linear(&self, s: &BatchState, centre: &DVector<f64>, slope: &DMatrix<f64>) -> DMatrix<f64> {
        let offsets = s.prior.factor() * &s.scale * &self.set.points;
        let mut predictions = (slope * offsets).insert_column(0, 0.0);
        for mut column in predictions.column_iter_mut() {
            column += centre;
        }
        predictions
    }
}

//! A Kalman filter for errors w + x of variance one: their innovations, their restricted likelihood, and what each innovation
//! moves the estimate by.
//!
//! Deliberately scalar: one channel, one form. Next file to read: [`super`].

use nalgebra::{DMatrix, DVector};

use super::super::Series;

/// A form of the errors.
pub(in crate::sandwich) struct Form {
    /// Correlation time of x.
    pub(in crate::sandwich) time: f64,
    /// Variance of w; that of x is one minus this.
    pub(in crate::sandwich) white: f64,
}

/// The gains of the filter at each observation time, which do not depend on the data.
struct Gains {
    /// Correlation with the time before; of no meaning for the first.
    kept: Vec<f64>,
    /// Variance of the innovation.
    variance: Vec<f64>,
    gain: Vec<f64>,
}

impl Gains {
    fn new(series: &Series, form: &Form) -> Self {
        let n = series.time.len();
        let slow = 1.0 - form.white;
        let mut gains = Self { kept: vec![0.0; n], variance: vec![0.0; n], gain: vec![0.0; n] };
        let mut before = slow;
        for t in 0..n {
            if t > 0 {
                let kept = ((series.time[t - 1] - series.time[t]) / form.time).exp();
                gains.kept[t] = kept;
                before = kept * kept * before + (1.0 - kept * kept) * slow;
            }
            gains.variance[t] = before + form.white;
            gains.gain[t] = before / gains.variance[t];
            before *= 1.0 - gains.gain[t];
        }
        gains
    }
}

/// -2 log restricted likelihood but for a constant, the size of the errors at its best; and that size, their variance.
pub(in crate::sandwich) fn deviance(series: &Series, form: &Form) -> (f64, f64) {
    let gains = Gains::new(series, form);
    let (n, p) = series.basis.shape();
    let mut products = DMatrix::<f64>::zeros(p + 1, p + 1);
    let mut state = DVector::<f64>::zeros(p + 1);
    let mut innovation = DVector::<f64>::zeros(p + 1);
    let mut log_det = 0.0;
    for t in 0..n {
        state *= gains.kept[t];
        for j in 0..p {
            innovation[j] = series.basis[(t, j)] - state[j];
        }
        innovation[p] = series.residual[t] - state[p];
        products.ger(1.0 / gains.variance[t], &innovation, &innovation, 1.0);
        state.axpy(gains.gain[t], &innovation, 1.0);
        log_det += gains.variance[t].ln();
    }
    // The other rows hold the rest of the basis, which is orthonormal.
    let own = series.basis.tr_mul(&series.basis);
    let hessian = products.view((0, 0), (p, p)) + DMatrix::identity(p, p) - &own;
    let pull = products.view((0, p), (p, 1)).into_owned();
    let Some(root) = hessian.cholesky() else { return (f64::INFINITY, 0.0) };
    let squares = products[(p, p)] - (root.solve(&pull).tr_mul(&pull))[0];
    let left = (n as f64 - own.trace()).max(1.0);
    let size = squares / left;
    (
        left * squares.ln() + log_det + 2.0 * root.l_dirty().diagonal().iter().map(|v| v.ln()).sum::<f64>(),
        size,
    )
}

/// A channel filtered by one form.
pub(in crate::sandwich) struct Filtered {
    /// Innovations of the residuals, length n.
    pub(in crate::sandwich) innovation: Vec<f64>,
    /// What one unit of each innovation moves the estimate by, now and through all later times; n of length p.
    pub(in crate::sandwich) influence: Vec<DVector<f64>>,
    /// Variances of the innovations for errors of variance one, length n.
    of_innovation: Vec<f64>,
}

impl Filtered {
    pub(in crate::sandwich) fn new(series: &Series, form: &Form) -> Self {
        let gains = Gains::new(series, form);
        let (n, p) = series.influence.shape();
        let mut innovation = vec![0.0; n];
        let mut state = 0.0;
        for (t, innovation) in innovation.iter_mut().enumerate() {
            state *= gains.kept[t];
            *innovation = series.residual[t] - state;
            state += gains.gain[t] * *innovation;
        }
        let mut influence = vec![DVector::zeros(p); n];
        let mut later = DVector::<f64>::zeros(p);
        for t in (0..n).rev() {
            let own = series.influence.row(t).transpose();
            influence[t] = &own + &later * gains.gain[t];
            later = (own + later) * gains.kept[t];
        }
        Self { innovation, influence, of_innovation: gains.variance }
    }

    /// Variance of what errors of variance one move each parameter by, length p.
    pub(in crate::sandwich) fn variance(&self) -> DVector<f64> {
        let p = self.influence.first().map_or(0, DVector::len);
        let mut sum = DVector::zeros(p);
        for (influence, variance) in self.influence.iter().zip(&self.of_innovation) {
            sum += influence.component_mul(influence) * *variance;
        }
        sum
    }
}

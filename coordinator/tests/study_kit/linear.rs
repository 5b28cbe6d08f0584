//! A model linear in its parameters, x = x0 + a t + b t²/2, and Bayesian linear regression in closed form
//! (Rasmussen & Williams 2006, section 2.1).

use nalgebra::{DMatrix, DVector};
use starlings_coordinator::study::Summary;

use super::{Done, csv, grid, normals, off};

pub const A: (f64, f64) = (0.5, 1.0);
pub const B: (f64, f64) = (-0.2, 0.8);
pub const START: (f64, f64) = (0.3, 0.5);
pub const NOISE: f64 = 0.1;
/// Truth of a, b, x0.
pub const TRUTH: [f64; 3] = [1.1, -0.7, 0.1];

/// The study with this `[estimator]` body and these `[[records]]`.
pub fn study_of(estimator: &str, records: &str) -> String {
    format!(
        r#"
[study]
name = "line"
[model]
kind = "equations"
outputs = [ {{ name = "y", value = "x" }} ]
[[model.states]]
name = "x"
initial = 0.0
rate = "a + b*t"
[[parameters]]
name = "a"
prior = {{ transform = "linear", median = {}, sd = {} }}
[[parameters]]
name = "b"
prior = {{ transform = "linear", median = {}, sd = {} }}
[[parameters]]
name = "initial:x"
prior = {{ transform = "linear", median = {}, sd = {} }}
{records}
[estimator]
{estimator}
"#,
        A.0, A.1, B.0, B.1, START.0, START.1
    )
}

/// The study of one record `line.csv`.
pub fn study(estimator: &str) -> String {
    study_of(estimator, &record("one", "line.csv", NOISE, ""))
}

/// One `[[records]]`.
pub fn record(name: &str, file: &str, noise: f64, more: &str) -> String {
    format!(
        "[[records]]\nname = \"{name}\"\nfile = \"{file}\"\nchannels = [ {{ column = \"y\", output = \"y\", noise = {noise} }} ]\n{more}\n"
    )
}

/// x0 + a t + b t²/2.
pub fn value(theta: [f64; 3], t: f64) -> f64 {
    theta[2] + theta[0] * t + 0.5 * theta[1] * t * t
}

/// Noisy observations of the truth.
pub fn data(n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let times = grid(n, 0.1);
    let z = times.iter().zip(normals(n, seed)).map(|(t, e)| value(TRUTH, *t) + NOISE * e).collect();
    (times, z)
}

pub fn file(times: &[f64], z: &[f64]) -> String {
    csv("time,y", &[times, z])
}

/// A linear Gaussian problem: z = H θ + noise.
pub struct Regression {
    pub h: DMatrix<f64>,
    pub z: DVector<f64>,
    pub noise: DVector<f64>,
    pub mean: DVector<f64>,
    pub sd: DVector<f64>,
}

/// Its answer.
pub struct Answer {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
    pub evidence: f64,
}

impl Regression {
    /// The study of one record; missing values are left out.
    pub fn of_record(times: &[f64], z: &[f64]) -> Self {
        let rows: Vec<usize> = (0..z.len()).filter(|i| z[*i].is_finite()).collect();
        let h = DMatrix::from_fn(rows.len(), 3, |i, j| {
            let t = times[rows[i]];
            [t, 0.5 * t * t, 1.0][j]
        });
        Self {
            h,
            z: DVector::from_iterator(rows.len(), rows.iter().map(|i| z[*i])),
            noise: DVector::from_element(rows.len(), NOISE),
            mean: DVector::from_column_slice(&[A.0, B.0, START.0]),
            sd: DVector::from_column_slice(&[A.1, B.1, START.1]),
        }
    }

    pub fn solve(&self) -> Answer {
        let prior = DMatrix::from_diagonal(&self.sd.map(|s| s * s));
        let spread =
            &self.h * &prior * self.h.transpose() + DMatrix::from_diagonal(&self.noise.map(|s| s * s));
        let root = spread.cholesky().unwrap();
        let innovation = &self.z - &self.h * &self.mean;
        let gain = &prior * self.h.transpose();
        let log_det: f64 = 2.0 * root.l().diagonal().iter().map(|v| v.ln()).sum::<f64>();
        let m = self.z.len() as f64;
        let distance = innovation.dot(&root.solve(&innovation));
        Answer {
            mean: &self.mean + &gain * root.solve(&innovation),
            covariance: &prior - &gain * root.solve(&gain.transpose()),
            evidence: -0.5 * (m * (2.0 * std::f64::consts::PI).ln() + log_det + distance),
        }
    }
}

/// Largest relative deviation of a run from the closed form: means in sd, sd, correlations, evidence.
pub fn deviation(summary: &Summary, answer: &Answer) -> f64 {
    let mut worst = off(summary.fit.log_likelihood, answer.evidence, 1.0);
    for (j, p) in summary.parameters.iter().enumerate() {
        let sd = answer.covariance[(j, j)].sqrt();
        worst = worst.max((p.estimate - answer.mean[j]).abs() / sd).max(off(p.sd, sd, 0.0));
        for (k, value) in summary.correlation[j].iter().enumerate() {
            let exact = answer.covariance[(j, k)] / (sd * answer.covariance[(k, k)].sqrt());
            worst = worst.max((value - exact).abs());
        }
    }
    worst
}

/// Panics unless the run is the closed form to this deviation.
pub fn assert_exact(done: &Done, answer: &Answer, tolerance: f64, what: &str) {
    let worst = deviation(&done.summary, answer);
    assert!(worst < tolerance, "{what}: {worst:e} off; {:?} {:?}", done.summary.parameters, answer.mean);
}

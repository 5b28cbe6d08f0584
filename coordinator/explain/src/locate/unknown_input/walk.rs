//! The filter over one record, and the smoother that goes back through it.
//!
//! The unknowns z are the states and the input b. Over a window they are z = m + L ξ with ξ ~ N(0, 1) of a few coordinates,
//! one particle per sigma point of ξ. The model carries the particles to the window's end, where the analysis makes
//! ξ ~ N(μ, C Cᵀ); then b takes a random step, and the joint factor [L C, q e_b] is cut to its leading columns. Because a
//! run carries ξ along unchanged, the Rauch–Tung–Striebel smoother (AIAA Journal 3, 1965) needs no inverse: it goes back
//! from coordinates to coordinates. Next file to read: `estimators/src/roukf.rs`.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{Data, Filter, Gaussian, Noise, Particles, Points, Root, Roukf, SigmaSet};
use starlings_fleet::Fleet;
use starlings_models::{Job, Prediction, Window};
use starlings_study::Study;

use super::candidate::{Candidate, predictions};
use crate::error::{ExplainError, fleet_failure};

/// Coordinates at most.
pub(super) const DIRECTIONS: usize = 4;
/// Steps of the walk that the input may be away from zero at the start.
const START: f64 = 4.0;

/// One equation's unknown input along one record.
pub(super) struct Walk<'a> {
    pub(super) study: &'a Study,
    pub(super) candidate: &'a Candidate,
    pub(super) record: usize,
    /// A job's parameters without the input.
    pub(super) theta: Vec<f64>,
    /// Positions of the scalar states in the state vector.
    pub(super) scalars: Vec<usize>,
}

/// What one intensity of the walk gives.
pub(super) struct Estimate {
    pub(super) time: Vec<f64>,
    pub(super) value: Vec<f64>,
    pub(super) sd: Vec<f64>,
    /// Courses of the scalar states, in the order of [`Walk::scalars`].
    pub(super) states: Vec<Vec<f64>>,
    pub(super) log_likelihood: f64,
    /// Log-likelihood of the model without the input.
    pub(super) without: f64,
}

/// One walk on its way: z = mean + factor ξ at the end of the last window, the states first, then the input.
struct Forward {
    /// Sd of one step of the walk.
    step: f64,
    mean: DVector<f64>,
    factor: DMatrix<f64>,
    size: DVector<f64>,
    past: Vec<Past>,
    log_likelihood: f64,
}

/// What the smoother needs of one window.
struct Past {
    time: f64,
    /// Rows of the scalar states and, last, of the input at the window's end, before the analysis.
    mean: Vec<f64>,
    factor: DMatrix<f64>,
    /// Analysis of the coordinates.
    mu: DVector<f64>,
    c: DMatrix<f64>,
    /// How the coordinates after the random step see (η, w).
    rotation: DMatrix<f64>,
}

impl Walk<'_> {
    /// One estimate per intensity, all in the same batches; `None` where a run failed.
    pub(super) fn estimate(
        &self,
        fleet: &mut dyn Fleet,
        intensities: &[f64],
        runs: &mut u64,
    ) -> Result<Vec<Option<Estimate>>, ExplainError> {
        let windows = self.study.windows(self.record);
        *runs += 1;
        let Some(start) = self.start(fleet, &windows)? else { return Ok(Vec::new()) };
        let n = start.len() + 1;
        let set = SigmaSet::new(Points::Simplex, n.min(DIRECTIONS))?;
        let roukf = Roukf { set, root: Root::Symmetric };
        let mut walks: Vec<Option<Forward>> =
            intensities.iter().map(|i| Some(self.begin(&roukf, &start, *i, windows.len()))).collect();
        for window in &windows {
            let particles: Vec<Option<DMatrix<f64>>> = walks
                .iter()
                .map(|w| w.as_ref().map(|w| spread(&w.mean, &(&w.factor * &roukf.set.points))))
                .collect();
            let predictions = self.fly(fleet, window, &particles)?;
            for (walk, predictions) in walks.iter_mut().zip(predictions) {
                *walk = match (walk.take(), predictions) {
                    (Some(walk), Some(predictions)) => self.observe(&roukf, walk, window, &predictions),
                    _ => None,
                };
            }
        }
        // Whole records: every walk runs all windows with every particle.
        *runs += (intensities.len() * roukf.set.n_particle()) as u64;
        let without = self.without();
        Ok(walks.into_iter().map(|walk| Some(walk?.smooth(without))).collect())
    }

    fn job(&self, window: &Arc<Window>, state: Option<Vec<f64>>, input: f64) -> Job {
        let theta = self.theta.iter().copied().chain([input]).collect();
        Job {
            particle: 0,
            record: self.record as u32,
            window: Arc::clone(window),
            theta,
            state: state.map(Into::into),
        }
    }

    /// The state at the record's start.
    fn start(
        &self,
        fleet: &mut dyn Fleet,
        windows: &[Arc<Window>],
    ) -> Result<Option<Vec<f64>>, ExplainError> {
        let Some(first) = windows.first() else { return Ok(None) };
        let n_obs = self.study.setup.outputs.len();
        let window = Window::free(first.start, vec![first.start], n_obs, first.inputs.clone());
        let window = Arc::new(window);
        let outcomes = fleet.run(self.candidate.setup, vec![self.job(&window, None, 0.0)]);
        let outcomes = outcomes.map_err(|error| fleet_failure(self.study, error))?;
        let prediction = predictions(self.study, self.record, &window, outcomes).pop().flatten();
        Ok(prediction.map(|p| p.state.into_vec()))
    }

    fn begin(&self, roukf: &Roukf, start: &[f64], intensity: f64, windows: usize) -> Forward {
        let n = start.len();
        let step = intensity * self.candidate.scale / (windows as f64).sqrt();
        let mut factor = DMatrix::zeros(n + 1, roukf.set.n_param());
        factor[(n, 0)] = START * step;
        let largest = start.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let of = |i: usize| {
            if i < n { start[i].abs().max(1e-3 * largest).max(1e-9) } else { self.candidate.scale }
        };
        Forward {
            step,
            mean: DVector::from_fn(n + 1, |i, _| start.get(i).copied().unwrap_or(0.0)),
            factor,
            size: DVector::from_fn(n + 1, |i, _| of(i)),
            past: Vec::with_capacity(windows),
            log_likelihood: 0.0,
        }
    }

    /// Runs the particles of all walks over a window; `None` for a walk of which one failed.
    fn fly(
        &self,
        fleet: &mut dyn Fleet,
        window: &Arc<Window>,
        particles: &[Option<DMatrix<f64>>],
    ) -> Result<Vec<Option<Vec<Prediction>>>, ExplainError> {
        let mut jobs = Vec::new();
        for z in particles.iter().flatten() {
            let n = z.nrows() - 1;
            jobs.extend(
                z.column_iter().map(|c| self.job(window, Some(c.rows(0, n).iter().copied().collect()), c[n])),
            );
        }
        for (index, job) in jobs.iter_mut().enumerate() {
            job.particle = index as u32;
        }
        let outcomes =
            fleet.run(self.candidate.setup, jobs).map_err(|error| fleet_failure(self.study, error))?;
        let mut answers = predictions(self.study, self.record, window, outcomes).into_iter();
        let mut of_walk = |z: &DMatrix<f64>| {
            let of_walk: Vec<_> = answers.by_ref().take(z.ncols()).collect();
            let predictions: Vec<Prediction> = of_walk.into_iter().collect::<Option<_>>()?;
            predictions.iter().all(|p| p.state.len() + 1 == z.nrows()).then_some(predictions)
        };
        Ok(particles.iter().map(|z| z.as_ref().and_then(&mut of_walk)).collect())
    }

    /// Analysis at the window's end, and the random step after it; `None` when the arithmetic fails.
    fn observe(
        &self,
        roukf: &Roukf,
        mut walk: Forward,
        window: &Window,
        predictions: &[Prediction],
    ) -> Option<Forward> {
        let (n, r) = (walk.mean.len() - 1, predictions.len());
        let inputs = spread(&walk.mean, &(&walk.factor * &roukf.set.points)).row(n).into_owned();
        let z = DMatrix::from_fn(n + 1, r, |i, j| if i < n { predictions[j].state[i] } else { inputs[j] });
        let outputs = DMatrix::from_fn(window.observed.len(), r, |i, j| predictions[j].outputs[i]);
        let sd = self.study.noise(self.record);
        let noise = Noise::Diagonal(window.times.iter().flat_map(|_| sd.iter().copied()).collect());
        let k = roukf.set.n_param();
        let before = roukf.init(&Gaussian::independent(&vec![0.0; k], &vec![1.0; k]));
        let data = Data { values: &window.observed, noise: &noise };
        let (after, analysis): (Particles, _) = roukf.analysis(&before, &outputs, &data).ok()?;
        let dual = DMatrix::from_fn(r, k, |j, i| roukf.set.weights[j] * roukf.set.points[(i, j)]);
        let (mean, factor) = (&z * &roukf.set.weights, &z * &dual);
        let (mu, c) = (roukf.mean(&after), &after.theta * &dual);
        walk.log_likelihood += analysis.log_likelihood;
        walk.mean = &mean + &factor * &mu;
        for i in 0..n {
            walk.size[i] = walk.size[i].max(walk.mean[i].abs());
        }
        let mut joint = (&factor * &c).resize_horizontally(k + 1, 0.0);
        joint[(n, k)] = walk.step;
        let rotation = leading(&joint, &walk.size, k)?;
        walk.factor = joint * &rotation;
        let kept: Vec<usize> = self.scalars.iter().copied().chain([n]).collect();
        let time = window.times.last().copied().unwrap_or(window.start);
        let (mean, factor) = (kept.iter().map(|i| mean[*i]).collect(), factor.select_rows(&kept));
        walk.past.push(Past { time, mean, factor, mu, c, rotation });
        Some(walk)
    }

    /// Log-likelihood without an input.
    fn without(&self) -> f64 {
        let window = self.study.whole(self.record, true);
        let sd = self.study.noise(self.record);
        let of = |(k, (y, h)): (usize, (&f64, &f64))| {
            let sd = sd[k % sd.len()];
            -0.5 * (((y - h) / sd).powi(2) + (std::f64::consts::TAU * sd * sd).ln())
        };
        let pairs = window.observed.iter().zip(&self.candidate.without).enumerate();
        pairs.filter(|(_, (y, _))| y.is_finite()).map(of).sum()
    }
}

impl Forward {
    /// Back from the last window to the first: estimates given all data.
    fn smooth(self, without: f64) -> Estimate {
        let n = self.past.len();
        let n_scalar = self.past.first().map_or(0, |past| past.mean.len() - 1);
        let (mut value, mut sd, mut states) = (vec![0.0; n], vec![0.0; n], vec![vec![0.0; n]; n_scalar]);
        let mut later: Option<(DVector<f64>, DMatrix<f64>)> = None;
        for (index, past) in self.past.iter().enumerate().rev() {
            let k = past.mu.len();
            let (mean, covariance) = match &later {
                None => (past.mu.clone(), &past.c * past.c.transpose()),
                Some((s, p)) => {
                    let v = &past.rotation;
                    let unseen = DMatrix::identity(k + 1, k + 1) - v * v.transpose();
                    let whole = v * p * v.transpose() + unseen;
                    let eta = (v * s).rows(0, k).into_owned();
                    let spread = whole.view((0, 0), (k, k)).into_owned();
                    (&past.mu + &past.c * eta, &past.c * spread * past.c.transpose())
                }
            };
            let z = &past.factor * &mean;
            let input = past.factor.row(n_scalar);
            let variance = (input * &covariance * input.transpose())[(0, 0)];
            for (i, course) in states.iter_mut().enumerate() {
                course[index] = past.mean[i] + z[i];
            }
            value[index] = past.mean[n_scalar] + z[n_scalar];
            sd[index] = variance.max(0.0).sqrt();
            later = Some((mean, covariance));
        }
        let time = self.past.iter().map(|p| p.time).collect();
        Estimate { time, value, sd, states, log_likelihood: self.log_likelihood, without }
    }
}

/// centre 1ᵀ + offsets.
fn spread(centre: &DVector<f64>, offsets: &DMatrix<f64>) -> DMatrix<f64> {
    let mut z = offsets.clone();
    for mut column in z.column_iter_mut() {
        column += centre;
    }
    z
}

/// The `k` leading right directions of a factor whose rows are measured in `size`: (k + 1) × k, orthonormal columns.
fn leading(factor: &DMatrix<f64>, size: &DVector<f64>, k: usize) -> Option<DMatrix<f64>> {
    let scaled = DMatrix::from_fn(factor.nrows(), factor.ncols(), |i, j| factor[(i, j)] / size[i]);
    let gram = scaled.transpose() * &scaled;
    if gram.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let limit = 100 * gram.nrows().max(30);
    let eigen = gram.try_symmetric_eigen(f64::EPSILON, limit)?;
    let mut order: Vec<usize> = (0..factor.ncols()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    Some(eigen.eigenvectors.select_columns(&order[..k]))
}

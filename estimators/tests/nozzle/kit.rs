//! A gimballed nozzle that something strikes: the recordings, and eight scenarios of the torque.
//!
//! J φ'' + B φ' + K φ = l F + Q with F' τ = −(K_p φ + K_d φ')/l − F; angle and force are recorded with noise relative to their peaks.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::Gaussian;
use starlings_estimators::unknown_input::{LinearSystem, Recovered, Samples, recover};

const J: f64 = 4000.0;
const B: f64 = 4e4;
const K: f64 = 4e6;
const ARM: f64 = 1.2;
const KP: f64 = 6e5;
const KD: f64 = 1e4;
const LAG: f64 = 0.02;
pub(crate) const STEP: f64 = 0.002;
const N: usize = 750;

/// A blow at 0.1 s or later that rings with a mode of the structure.
fn pulse(t0: f64, amplitude: f64, rise: f64, frequency: f64, decay: f64) -> Vec<f64> {
    let value = |k: usize| {
        let s = k as f64 * STEP - t0;
        let shape = (-s / decay).exp() - (-s / rise).exp();
        if s > 0.0 { amplitude * shape * (std::f64::consts::TAU * frequency * s).cos() } else { 0.0 }
    };
    (0..N).map(value).collect()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// The scenarios, in N m.
pub(crate) fn library() -> Vec<Vec<f64>> {
    let (blow, ring) = (pulse(0.1, 3e4, 0.004, 8.0, 0.1), pulse(0.1, 5e4, 0.004, 14.0, 0.06));
    vec![
        blow.clone(),
        pulse(0.1, 6e4, 0.004, 14.0, 0.06),
        pulse(0.1, 2e4, 0.004, 0.0, 0.25),
        sum(&blow, &pulse(0.45, 3e4, 0.004, 8.0, 0.1)),
        pulse(0.1, 4e4, 0.004, 25.5, 0.08),
        sum(&ring, &pulse(0.3, -2.5e4, 0.004, 8.0, 0.1)),
        pulse(0.1, 3e4, 0.02, 8.0, 0.25),
        pulse(0.1, 1e4, 0.004, 25.5, 0.3),
    ]
}

/// The nozzle with its actuator, of which angle and force are seen.
fn closed_loop() -> LinearSystem {
    LinearSystem {
        rate: DMatrix::from_row_slice(
            3,
            3,
            &[0.0, 1.0, 0.0, -K / J, -B / J, ARM / J, -KP / ARM / LAG, -KD / ARM / LAG, -1.0 / LAG],
        ),
        known: DMatrix::zeros(3, 0),
        unknown: DVector::from_vec(vec![0.0, 1.0 / J, 0.0]),
        outputs: DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    }
}

/// The nozzle under a force that is known.
pub(crate) fn nozzle() -> LinearSystem {
    LinearSystem {
        rate: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -K / J, -B / J]),
        known: DMatrix::from_row_slice(2, 1, &[0.0, ARM / J]),
        unknown: DVector::from_vec(vec![0.0, 1.0 / J]),
        outputs: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]),
    }
}

/// A recording with what it was made from.
pub(crate) struct Recording {
    pub(crate) severity: f64,
    pub(crate) torque: Vec<f64>,
    pub(crate) angle: DMatrix<f64>,
    pub(crate) force: DMatrix<f64>,
    /// Standard deviation of the noise of the angle.
    pub(crate) noise: f64,
}

/// A scenario of unknown severity, 1 ± 0.3, with noise relative to the peaks of angle and force.
pub(crate) fn recording(course: &[f64], noise: f64, seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    let severity = 1.0 + 0.3 * draw();
    let torque: Vec<f64> = course.iter().map(|q| severity * q).collect();
    let clean = closed_loop().response(STEP, &DMatrix::zeros(0, N), &torque).unwrap();
    let mut noisy = |row: usize| {
        let sd = noise * clean.row(row).amax();
        (clean.row(row).map(|v| v + sd * draw()), sd)
    };
    let ((angle, noise), (force, _)) = (noisy(0), noisy(1));
    let matrix = |row: nalgebra::RowDVector<f64>| DMatrix::from_row_slice(1, N, row.as_slice());
    Recording { severity, torque, angle: matrix(angle), force: matrix(force), noise }
}

/// The torque by the smoother.
pub(crate) fn recovered(recording: &Recording) -> Recovered {
    let start = Gaussian::independent(&[0.0; 3], &[1e-3, 0.1, 10.0]);
    let samples = Samples {
        step: STEP,
        observed: &recording.angle,
        noise: &[recording.noise],
        inputs: &recording.force,
    };
    recover(&nozzle(), &samples, &start, &[1e4, 3e4, 1e5, 3e5, 1e6]).unwrap()
}

/// The torque by dividing the recording by the system, with second differences (eq. 1.47 as it is printed).
pub(crate) fn divided(recording: &Recording) -> Vec<f64> {
    let y = recording.angle.as_slice();
    let slope = |y: &[f64], k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(N - 1));
        (y[b] - y[a]) / ((b - a) as f64 * STEP)
    };
    let first: Vec<f64> = (0..N).map(|k| slope(y, k)).collect();
    (0..N).map(|k| J * slope(&first, k) + B * first[k] + K * y[k] - recording.force[k] * ARM).collect()
}

/// Distance relative to the size of the truth.
pub(crate) fn relative_error(found: &[f64], truth: &[f64]) -> f64 {
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    squares(&mut found.iter().zip(truth).map(|(a, b)| a - b)) / squares(&mut truth.iter().copied())
}

pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

/// The angle less what the recorded force makes of it: what the torque alone does.
pub(crate) fn recorded_angle(recording: &Recording) -> Vec<f64> {
    let by_force = nozzle().response(STEP, &recording.force, &[0.0; N]).unwrap();
    (&recording.angle - by_force).as_slice().to_vec()
}

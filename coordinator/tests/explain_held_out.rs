//! Held-out records against a closed form: they are run with the mean of the fitted records' values or with a prior, and the band
//! of their predictions must contain the uncertainty of both.
#![allow(missing_docs, clippy::unwrap_used)]

mod study_kit;

use nalgebra::{DMatrix, DVector};
use starlings_coordinator::explain::{Context, FittedVariant, HeldOut, Options, RunCache, drive, explain};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::store::Store;
use study_kit::{Case, csv, grid, normals};

const NOISE: f64 = 0.1;
/// Prior standard deviations of the start of a record, of the slope that all share, and of the curvature of a record.
const START: f64 = 0.5;
const SLOPE: f64 = 1.0;
const CURVATURE: f64 = 0.8;

/// y = x0 + c t + g t², with a start and a curvature per record; record C is held out.
fn study() -> String {
    let record = |name: &str, more: &str| {
        format!(
            "[[records]]\nname = \"{name}\"\nfile = \"{name}.csv\"\ntime = \"time\"\n\
             channels = [ {{ column = \"y\", output = \"y\", noise = {NOISE} }} ]\n{more}\n"
        )
    };
    format!(
        r#"
[study]
name = "line"
seed = 1

[model]
kind = "equations"
outputs = [ {{ name = "y", unit = "m", value = "x" }} ]

[[model.states]]
name = "x"
unit = "m"
initial = 1.0
rate = "c + 2*g*t"

[[parameters]]
name = "c"
unit = "m/s"
prior = {{ transform = "linear", median = 0.0, sd = {SLOPE} }}

[[parameters]]
name = "g"
unit = "m/s^2"
per_record = true
prior = {{ transform = "linear", median = 0.0, sd = {CURVATURE} }}

[[parameters]]
name = "initial:x"
unit = "m"
prior = {{ transform = "linear", median = 1.0, sd = {START} }}

{}{}{}"#,
        record("A", ""),
        record("B", ""),
        record("C", "use = \"held-out\"")
    )
}

/// A recording with this start and curvature, a slope of 0.5 m/s and noise.
fn recorded(start: f64, curvature: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let times = grid(11, 0.1);
    let noise = normals(times.len(), seed);
    let y = times.iter().zip(noise).map(|(t, e)| start + 0.5 * t + curvature * t * t + NOISE * e).collect();
    (times, y)
}

/// The posterior of (c, gA, gB, xA, xB) by linear algebra, and with it the mean and covariance of record C's rows, noise
/// included, its own start and curvature unknown.
fn closed_form(a: &[f64], b: &[f64], times: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let n = times.len();
    let mut h = DMatrix::zeros(2 * n, 5);
    for (i, t) in times.iter().enumerate() {
        for record in 0..2 {
            let row = record * n + i;
            (h[(row, 0)], h[(row, 1 + record)], h[(row, 3 + record)]) = (*t, t * t, 1.0);
        }
    }
    let prior_sd = DVector::from_vec(vec![SLOPE, CURVATURE, CURVATURE, START, START]);
    let prior = DVector::from_vec(vec![0.0, 0.0, 0.0, 1.0, 1.0]);
    let precision = DMatrix::from_diagonal(&prior_sd.map(|s| 1.0 / (s * s)));
    let y = DVector::from_iterator(2 * n, a.iter().chain(b).copied());
    let information = h.tr_mul(&h) / (NOISE * NOISE) + &precision;
    let covariance = information.cholesky().unwrap().inverse();
    let mean = &covariance * (h.tr_mul(&y) / (NOISE * NOISE) + precision * prior);
    // Run with the mean of the two curvatures and the prior median of the start; the own curvature deviates from that mean
    // by the scatter of the two, the own start from the median by its prior.
    let of_c = DMatrix::from_fn(n, 5, |i, j| match j {
        0 => times[i],
        1 | 2 => 0.5 * times[i] * times[i],
        _ => 0.0,
    });
    let scatter = (mean[1] - mean[2]).powi(2) / 2.0;
    let own = DMatrix::from_fn(n, n, |i, j| START * START + scatter * (times[i] * times[j]).powi(2));
    let noise = DMatrix::identity(n, n) * (NOISE * NOISE);
    let predicted = &of_c * &mean + DVector::from_element(n, 1.0);
    (predicted, &of_c * covariance * of_c.transpose() + own + noise)
}

fn case() -> (Case, Vec<Vec<f64>>) {
    let (times, a) = recorded(1.1, 0.3, 1);
    let (_, b) = recorded(0.8, -0.2, 2);
    let (_, c) = recorded(1.7, 0.4, 3);
    let file = |y: &[f64]| csv("time,y", &[&times, y]);
    let case = Case::new(&study(), &[("A.csv", file(&a)), ("B.csv", file(&b)), ("C.csv", file(&c))]);
    (case, vec![times, a, b, c])
}

fn store(case: &Case) -> Store {
    let path = case.fresh();
    std::fs::create_dir_all(&path).unwrap();
    Store::create(&path.join("run.db"), &[]).unwrap()
}

/// The model is linear, so that differences of a step of 1e-3 are exact up to the rounding of the predictions: 1e-16/1e-3, and the
/// integration's tolerance.
const EXACT: f64 = 1e-6;

#[test]
fn the_band_of_a_held_out_record_is_that_of_the_means_and_priors_that_it_is_run_with() {
    let (case, data) = case();
    let (study, store): (Study, Store) = (case.study(), store(&case));
    let mut fleet = InProcess::new(1);
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let mut cache = RunCache::new(&study, &mut fleet, &store, &mut context, None);
    let mut fits = [FittedVariant::of_study(&study).unwrap()];
    assert!(drive(&mut cache, &mut fits).unwrap());
    let [mut fit] = fits;
    fit.measure_own_values(&mut cache).unwrap();
    let (predicted, covariance) = closed_form(&data[1], &data[2], &data[0]);
    let of_c: Vec<usize> = (0..cache.rows.rows.len()).filter(|i| cache.rows.rows[*i].record == 2).collect();
    let jacobian = fit.dense_jacobian(&cache.rows).select_rows(&of_c);
    let own = fit.own_values.select_rows(&of_c);
    let optimum = fit.optimum().unwrap();
    let band = &jacobian * optimum.covariance() * jacobian.transpose() + &own * own.transpose();
    let band = (band + DMatrix::identity(of_c.len(), of_c.len())) * (NOISE * NOISE);
    for (k, i) in of_c.iter().enumerate() {
        assert!(
            (fit.predicted[*i] - predicted[k]).abs() < EXACT,
            "row {k}: {} {}",
            fit.predicted[*i],
            predicted[k]
        );
    }
    assert!((&band - &covariance).amax() < EXACT, "{band} {covariance}");
    // Only the rows of the held-out record depend on values of its own.
    let others = (0..fit.own_values.nrows()).filter(|i| !of_c.contains(i));
    assert!(others.into_iter().all(|i| fit.own_values.row(i).amax() <= 0.0));
}

#[test]
fn the_gates_measure_a_held_out_record_by_its_distance_in_that_band() {
    let (case, data) = case();
    let (study, store) = (case.study(), store(&case));
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let found = explain(&study, &mut InProcess::new(1), &store, &mut context, &Options::default()).unwrap();
    let said: &HeldOut = found.explanation.held_out.iter().find(|h| h.record == "C").unwrap();
    let (predicted, covariance) = closed_form(&data[1], &data[2], &data[0]);
    let error = DVector::from_row_slice(&data[3]) - predicted;
    let n = error.len() as f64;
    let distance = error.dot(&covariance.cholesky().unwrap().solve(&error));
    assert!((said.before - (error.norm_squared() / n).sqrt() / NOISE).abs() < 1e-4, "{said:?}");
    assert!((said.beyond - (distance / n).sqrt()).abs() < 1e-4, "{said:?}, {distance}");
    // Seven times the noise, which the unknown start and curvature of that record explain.
    assert!(said.before > 5.0 && !said.fails, "{said:?}");
}

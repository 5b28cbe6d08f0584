//! Explanations of recordings of surfaces: rows are signed distances to the surfaces, as channels measure them; tracks are the
//! outputs of the model itself.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

use std::path::Path;

use nalgebra::DVector;
use starlings_coordinator::explain::{Context, Point, RunCache};
use starlings_coordinator::fleet::{Fleet, InProcess};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::store::Store;
use starlings_models::Job;

/// The images of a vessel, the first so many times.
fn images(folder: &Path, n: usize) -> Study {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/wall-images");
    for name in ["study.toml", "rest.csv", "flow.csv", "profiles.csv"] {
        std::fs::copy(example.join(name), folder.join(name)).unwrap();
    }
    let first = |name: &str, last: f64| {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let within = |line: &&str| line.split(',').next().unwrap().parse().map_or(true, |t: f64| t <= last);
        std::fs::write(folder.join(name), text.lines().filter(within).collect::<Vec<_>>().join("\n"))
            .unwrap();
    };
    let last = 0.02 * (n - 1) as f64 + 1e-9;
    first("flow.csv", last);
    first("profiles.csv", last);
    Study::load(&folder.join("study.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// What the model itself predicts of the outputs of a study at its prior median.
fn raw(study: &Study, theta: &DVector<f64>) -> Vec<f64> {
    let mut fleet = InProcess::new(1);
    let setup = fleet.install(&study.setup).unwrap();
    let (window, theta) = (study.whole(0, false).into(), study.theta_for(0, theta.as_slice()));
    let job = Job { particle: 0, record: 0, window, theta, state: None };
    fleet.run(setup, vec![job]).unwrap().remove(0).result.unwrap().outputs
}

#[test]
fn courses_are_what_the_model_predicts_and_rows_what_the_channels_measure() {
    let folder = tempfile::tempdir().unwrap();
    let study = images(folder.path(), 12);
    let theta = DVector::from_iterator(study.theta.len(), study.theta.iter().map(|t| t.prior_mean));
    let store = Store::create(&folder.path().join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let mut fleet = InProcess::new(2);
    let mut cache = RunCache::new(&study, &mut fleet, &store, &mut context, None);
    let point = || Point { study: &study, theta: theta.clone() };

    let tracks = cache.tracks(&point()).unwrap();
    let scalar = || study.spec.outputs.iter().chain(&study.spec.states).filter(|q| q.size == 1);
    assert!(scalar().count() >= 3);
    for quantity in scalar() {
        let track = tracks.iter().find(|t| t.name == quantity.name).unwrap();
        let mut alone = study.clone();
        alone.setup.outputs = vec![quantity.name.clone()];
        std::sync::Arc::make_mut(&mut alone.records)[0].channels.clear();
        assert_eq!(track.values, [raw(&alone, &theta)], "{}", quantity.name);
    }

    // The rows of the same study: signed distances of the displaced nodes to the surfaces.
    let predicted = cache.run(&[point()]).unwrap().remove(0).unwrap();
    let mut measured = raw(&study, &theta);
    let displaced = measured.clone();
    study.measure(0, &study.records[0].times, &mut measured);
    assert_ne!(measured, displaced);
    let n_obs = study.setup.outputs.len();
    for (row, y) in cache.rows.rows.iter().zip(predicted.iter()) {
        assert_eq!(*y, measured[row.step * n_obs + row.output]);
    }
    let n = cache.rows.rows.len();
    assert!(n > 80, "{n} of ten nodes at twelve times");
    // A second request is answered from memory, and its outputs are turned into distances only once.
    assert_eq!(cache.run(&[point()]).unwrap().remove(0).unwrap(), predicted);
}

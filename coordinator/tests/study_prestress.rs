//! The stiffness of a wall whose reference was never imaged: data of a nonlinear vessel from its unloaded shape, estimated with the
//! linear tube from the image under diastolic pressure.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]
mod study_kit;

use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use starlings_models::prestress::Rings;
use study_kit::{Case, csv, grid};

const YOUNG: f64 = 4e6;
const DIASTOLE: f64 = 80.0 * 1333.22;
const CELLS: usize = 10;

const TRUTH: &str = r#"
[study]
name = "truth"
[model]
kind = "artery-1d"
[model.layout]
segments = [ { name = "v", from = "in", to = "out", length = 25.0, radius = 1.0, thickness = 0.15, cells = 10 } ]
nodes = [ { name = "in", kind = "inlet" }, { name = "out", kind = "rcr" } ]
[[parameters]]
name = "E1"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[records]]
name = "beats"
file = "wall.csv"
inputs = { flow = "flow" }
channels = [ { column = "zero", output = "inlet_pressure", noise = 1.0 } ]
"#;

/// The tube of the image: radius, layout and channel are to be filled in.
const TUBE: &str = r#"
[study]
name = "tube"
[model]
kind = "fsi-tube"
constants = { R = RADIUS }
[model.layout]
cells = 10
regions = 1
IMAGE
[[parameters]]
name = "E1"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[records]]
name = "beats"
file = "wall.csv"
inputs = { flow = "flow" }
channels = [ { CHANNEL } ]
[estimator]
kind = "batch"
"#;
const DISPLACEMENT: &str = r#"column = "displacement", output = "displacement", noise = 0.0001"#;
/// The registered displacement differentiated: what ultrasound or phase contrast measures directly.
const VELOCITY: &str = r#"column = "displacement", output = "velocity", from = "integral", noise = 0.0001"#;

fn truth() -> Recording {
    let times = grid(81, 0.01);
    let sine = |t: &f64| if *t < 0.3 { 200.0 * (std::f64::consts::PI * t / 0.3).sin().powi(2) } else { 0.0 };
    let flow: Vec<f64> = times.iter().map(sine).collect();
    let blank = csv("time,flow,zero", &[&times, &flow, &[0.0; 81]]);
    let study = Case::new(TRUTH, &[("wall.csv", blank)]).study();
    simulate(&study, &Twin { values: vec![("E1".to_owned(), YOUNG)], ..Twin::default() }).unwrap()
}

/// The radius in the image, and the recording: displacement from the image at every cell.
fn images() -> (f64, String) {
    let of = truth();
    let at = |name: &str| &of.values[of.columns.iter().position(|c| c == name).unwrap()];
    let cells: Vec<&Vec<f64>> = (0..CELLS).map(|i| at(&format!("displacement[{i}]"))).collect();
    let imaged = cells[0][0];
    let moved: Vec<Vec<f64>> = cells.iter().map(|c| c.iter().map(|d| d - imaged).collect()).collect();
    let names: Vec<String> = (0..CELLS).map(|i| format!("displacement[{i}]")).collect();
    let columns: Vec<&[f64]> = [&of.times, at("flow")].into_iter().chain(&moved).map(Vec::as_slice).collect();
    (1.0 + imaged, csv(&format!("time,flow,{}", names.join(",")), &columns))
}

fn estimate(radius: f64, image: &str, channel: &str, data: &str) -> f64 {
    let study =
        TUBE.replace("RADIUS", &radius.to_string()).replace("IMAGE", image).replace("CHANNEL", channel);
    Case::new(&study, &[("wall.csv", data.to_owned())]).run().estimate("E1").estimate / YOUNG
}

#[test]
fn prestress_gives_the_stiffness_that_an_image_taken_for_the_reference_does_not() {
    let (radius, data) = images();
    // At rest under 80 mmHg: p R²/β = 0.13 of the unloaded radius.
    let strain = DIASTOLE * 0.75 / (YOUNG * 0.15);
    assert!((radius - 1.0 - strain).abs() < 1e-9, "{radius}");
    let image = format!("image_pressure = {DIASTOLE}");
    // The tube is linear, the vessel is not: its section and its waves change over the beat, which a velocity sees most.
    let [displacement, velocity] = [DISPLACEMENT, VELOCITY].map(|c| estimate(radius, &image, c, &data));
    assert!((displacement - 1.0).abs() < 0.02, "{displacement}");
    assert!((velocity - 1.0).abs() < 0.1, "{velocity}");
    // Without it, a velocity makes the wall too stiff by the square of the stretch in the image: the same E h/R² with the
    // image's R.
    let ring = Rings::new(&[velocity * YOUNG], &[0.15], 0.5);
    let stretch = radius / ring.unloaded(&[radius], DIASTOLE).unwrap().shape[0];
    let factor = estimate(radius, "", VELOCITY, &data) / velocity;
    // The prior weighs 1e-4 of what the data do.
    assert!((factor / stretch.powi(2) - 1.0).abs() < 1e-3 && factor > 1.25, "{factor} {stretch}");
    // A displacement from the image, taken for one from the shape without load, must be small although the pressure is not.
    let whole = estimate(radius, "", DISPLACEMENT, &data);
    assert!(whole > 10.0, "{whole}");
}

//! Every example with a built-in model is run as a user would run it and compared with its `expected.toml`.

mod common;
mod example_kit;

use std::collections::BTreeSet;

use common::repository;
use example_kit::{all, example_in, of_inference, of_solvers};

/// One test per example, and one that none is forgotten.
macro_rules! examples {
    ($($test:ident => $name:literal),+ $(,)?) => {
        $(#[test] fn $test() { example_in(&repository("examples").join($name)); })+

        #[test]
        fn every_example_is_tested() {
            let listed: BTreeSet<String> = [$($name),+].map(str::to_owned).into();
            let elsewhere = of_solvers().union(&of_inference()).cloned().collect();
            assert_eq!(listed, all().difference(&elsewhere).cloned().collect());
        }
    };
}

examples! {
    pig_aorta => "pig-aorta",
    pig_aorta_joint => "pig-aorta-joint",
    rcr => "rcr",
    oscillator => "oscillator",
    knsb_motor => "knsb-motor",
    rocket_motor => "rocket-motor",
    rcr_network => "rcr-network",
    coarctation => "coarctation",
    fsi_tube => "fsi-tube",
    fine_tube => "fine-tube",
    artery_1d => "artery-1d",
    wall_images => "wall-images",
    toy_fsi => "toy-fsi",
    toy_fsi_windkessel => "toy-fsi-windkessel",
    toy_fsi_stokes => "toy-fsi-stokes",
    plate => "plate",
    conical_shell => "conical-shell",
    thrust_vector_control => "thrust-vector-control",
    windkessel_human => "windkessel-human",
    pendulum => "pendulum",
    falling_balls => "falling-balls",
}

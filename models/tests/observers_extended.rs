//! Observers of a wall on a model with effects.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

use starlings_models::catalogue::NATIVE;
use starlings_models::effect::{Addition, EffectParameter, EffectState};
use starlings_models::observer::{self, Correction, Wiring};
use starlings_models::{BuildSetup, EffectDef, ModelDef, ObserverDef, Setup};

/// A tube with an effect on its Windkessel that has a parameter and a state of its own.
fn setup(with_effect: bool) -> Setup {
    let model = ModelDef { kind: "fsi-tube".to_owned(), ..ModelDef::default() };
    let effect = EffectDef {
        name: "leak".to_owned(),
        adds: vec![Addition { to: "pi".to_owned(), term: "-leak*lost".to_owned() }],
        parameters: vec![EffectParameter {
            name: "leak".to_owned(),
            unit: "1/s".to_owned(),
            range: [0.0, 10.0],
            ..EffectParameter::default()
        }],
        states: vec![EffectState {
            name: "lost".to_owned(),
            unit: "dyn/cm^2".to_owned(),
            initial: "7".to_owned(),
            rate: "pi - lost".to_owned(),
        }],
        ..EffectDef::default()
    };
    Setup { model, effects: if with_effect { vec![effect] } else { vec![] }, ..Setup::default() }
}

/// The state after one correction, and the feedback matrix.
fn corrected(with_effect: bool, kind: &str) -> (Vec<f64>, nalgebra::DMatrix<f64>) {
    let setup = setup(with_effect);
    let (model, spec) = (setup.model().unwrap(), setup.spec().unwrap());
    let theta: Vec<f64> = spec.parameters.iter().map(|q| q.default.unwrap_or(0.0)).collect();
    let outputs = ["displacement".to_owned(), "velocity".to_owned()];
    let wiring = Wiring { spec: &spec, outputs: &outputs, model: &*model, theta: &theta, native: NATIVE };
    let def = ObserverDef { kind: kind.to_owned(), gain: 3.0, ..ObserverDef::default() };
    let observer = observer::build(&def, wiring).unwrap();
    let mut x = vec![0.0; spec.n_state()];
    model.initial(&theta, &mut x);
    let predicted = vec![0.0; 50];
    let observed: Vec<f64> = (0..50).map(|i| (i as f64).sin()).collect();
    let at = Correction {
        t: 0.0,
        spans: &[0.01; 50],
        observed: &observed,
        predicted: &predicted,
        model: &*model,
        theta: &theta,
    };
    observer.correct(at, &mut x);
    (x, observer.feedback(&*model, &theta))
}

#[test]
fn an_observer_of_a_wall_corrects_a_model_with_an_effect_as_it_does_without() {
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"] {
        let ((plain, gamma), (extended, wide)) = (corrected(false, kind), corrected(true, kind));
        assert_eq!(extended[..51], plain[..], "{kind}: the tube's own states");
        assert_eq!(extended[51], 7.0, "{kind}: the effect's state is not observed");
        assert_eq!(wide.view((0, 0), (51, 51)), gamma, "{kind}");
        assert!(wide.shape() == (52, 52) && wide.row(51).amax() == 0.0 && wide.column(51).amax() == 0.0);
        assert!(plain[..50].iter().any(|v| *v != plain[0]), "{kind} corrects");
    }
}

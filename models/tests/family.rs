//! What every model of the catalogue must do.
#![allow(clippy::float_cmp)]

mod common;

use common::{job, kinds, largest_difference, plausible, run, run_in_pieces, setup, window};
use starlings_models::integrate::{Solver, Tolerance};
use starlings_models::limits::Limits;
use starlings_models::segment::Segment;
use starlings_models::{
    BuildSetup, Model, ModelDef, ModelFailure, ParticleError, Spec, advance_by, catalogue,
};

#[test]
fn every_kind_has_a_sentence_and_a_name_of_its_own() {
    let specs = catalogue::specs();
    for (i, spec) in specs.iter().enumerate() {
        assert!(spec.says.ends_with('.'), "{}", spec.kind);
        assert!(specs[..i].iter().all(|other| other.kind != spec.kind), "{} twice", spec.kind);
    }
}

#[test]
fn every_name_of_a_state_parameter_output_or_input_is_given_once() {
    for kind in kinds() {
        let (setup, _) = setup(&kind);
        let spec = setup.spec().unwrap();
        for list in [&spec.states, &spec.parameters, &spec.outputs, &spec.inputs] {
            let names: std::collections::BTreeSet<&str> = list.iter().map(|q| q.name.as_str()).collect();
            assert_eq!(names.len(), list.len(), "{kind}: {names:?}");
        }
    }
}

/// A term of an effect that adds to such a name enters the rate of the state: nobody may find another quantity under it. A term for
/// the output says `output:NAME`.
#[test]
fn an_output_with_the_name_of_a_state_shows_that_state() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let spec = setup.spec().unwrap();
        let (window, model) = (window(&setup, 8), setup.build().unwrap());
        let prediction = run(&*model, &window, &theta);
        let shown = &prediction.outputs[prediction.outputs.len() - spec.n_output()..];
        for output in &spec.outputs {
            let Some(state) = spec.states.iter().find(|state| state.name == output.name) else { continue };
            assert_eq!(state.size, output.size, "{kind}: {}", output.name);
            let place = |list| Spec::offset(list, &output.name).unwrap();
            let (x, y) = (place(&spec.states), place(&spec.outputs));
            let (x, y) = (&prediction.state[x..x + state.size], &shown[y..y + output.size]);
            assert_eq!(x, y, "{kind}: {} is a state and an output", output.name);
        }
    }
}

#[test]
fn every_model_starts_from_a_finite_state_and_predicts_every_output() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let prediction = run(&*setup.build().unwrap(), &window(&setup, 20), &theta);
        let spec = setup.spec().unwrap();
        assert_eq!(prediction.outputs.len(), 20 * spec.n_output(), "{kind}");
        assert_eq!(prediction.state.len(), spec.n_state(), "{kind}");
        let model = setup.model().unwrap();
        let mut x = vec![f64::NAN; spec.n_state()];
        model.initial(&theta, &mut x);
        assert!(x.iter().all(|v| v.is_finite()), "{kind}: {x:?}");
    }
}

#[test]
fn every_model_run_in_pieces_gives_the_bits_of_one_run() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let (model, window) = (setup.build().unwrap(), window(&setup, 24));
        let whole = run(&*model, &window, &theta);
        for every in [1, 5, 24] {
            // Bitwise: pieces end at observation times, where a whole run ends its steps too.
            assert_eq!(run_in_pieces(&*model, &window, &theta, every), whole, "{kind}, {every} times each");
        }
    }
}

#[test]
fn every_model_run_in_pieces_with_an_observer_gives_the_bits_of_one_run() {
    for kind in kinds() {
        let (mut setup, theta) = setup(&kind);
        setup.observer.kind = "nudging".to_owned();
        setup.observer.gain = 7.0;
        let mut window = window(&setup, 24);
        for (i, value) in window.observed.iter_mut().enumerate() {
            *value = if i % 5 == 0 { f64::NAN } else { (i as f64).cos() };
        }
        let model = setup.build().unwrap();
        let whole = run(&*model, &window, &theta);
        assert_eq!(run_in_pieces(&*model, &window, &theta, 5), whole, "{kind}");
        setup.observer.gain = 0.0;
        assert_ne!(run(&*setup.build().unwrap(), &window, &theta), whole, "{kind}: the observer did nothing");
    }
}

#[test]
fn every_model_gives_the_same_bits_twice() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let window = window(&setup, 20);
        let (first, second) = (setup.build().unwrap(), setup.build().unwrap());
        assert_eq!(run(&*first, &window, &theta), run(&*second, &window, &theta), "{kind}");
    }
}

#[test]
fn a_value_that_is_not_finite_is_an_error_that_names_it() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let (model, window) = (setup.build().unwrap(), window(&setup, 5));
        for (i, name) in setup.parameters.iter().enumerate() {
            let mut spoiled = theta.clone();
            spoiled[i] = f64::NAN;
            let error = model.run(&job(&window, &spoiled)).unwrap_err();
            let what = format!("parameter `{name}`");
            assert_eq!(error, ModelFailure::NotFinite { what, time: 0.0 }.into(), "{kind}");
        }
    }
}

#[test]
fn a_state_that_is_not_finite_is_named_before_anything_runs() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let spec = setup.spec().unwrap();
        let mut state = vec![1.0; spec.n_state()];
        state[spec.n_state() - 1] = f64::NAN;
        let job = starlings_models::Job { state: Some(state.into()), ..job(&window(&setup, 5), &theta) };
        let what = format!("state `{}`", Spec::component(&spec.states, spec.n_state() - 1));
        assert_eq!(
            setup.build().unwrap().run(&job),
            Err(ModelFailure::NotFinite { what, time: 0.0 }.into()),
            "{kind}"
        );
    }
}

#[test]
fn every_model_run_in_pieces_that_end_on_input_samples_gives_the_bits_of_one_run() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let (model, mut window) = (setup.build().unwrap(), window(&setup, 24));
        // Before zero and on a clock far from zero, samples on the observation times but for rounding.
        for offset in [-0.5, 1e6 / 3.0] {
            window.start = offset;
            window.times = (1..=24).map(|i| offset + f64::from(i) * 0.1).collect();
            for input in &mut window.inputs {
                input.times =
                    (0..input.values.len()).map(|i| offset + 0.05 + (i as f64 - 2.0) * 0.05).collect();
            }
            let whole = run(&*model, &window, &theta);
            for every in [1, 5] {
                assert_eq!(
                    run_in_pieces(&*model, &window, &theta, every),
                    whole,
                    "{kind}, {every} from {offset}"
                );
            }
        }
    }
}

#[test]
fn an_input_that_is_not_finite_is_an_error_and_not_a_panic() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let mut window = window(&setup, 5);
        let Some(input) = window.inputs.first_mut() else { continue };
        input.values[10] = f64::NAN;
        let error = setup.build().unwrap().run(&job(&window, &theta)).unwrap_err();
        assert!(matches!(error, ParticleError::Model(ModelFailure::NotFinite { .. })), "{kind}: {error}");
    }
}

/// How closely a model's own step follows its rate over a long segment.
fn closed_step_tolerance(kind: &str) -> f64 {
    match kind {
        // Velocities reach 100, pressures 1e5, and the waves take tens of thousands of steps.
        "toy-fsi" | "toy-fsi-windkessel" | "toy-fsi-stokes" => 1e-7,
        // Pascals: pressures of 6e6, to the tolerance of the integrator that the model has of its own.
        "rocket-motor" => 0.5,
        // Values reach 80 and a few hundred steps of relative error 1e-12 add up.
        _ => 1e-9,
    }
}

#[test]
fn every_closed_step_agrees_with_the_integrated_rate() {
    struct NoHistory;
    impl starlings_models::segment::History for NoHistory {
        fn at(&self, _: usize, _: f64) -> f64 {
            f64::NAN
        }
    }
    let tolerance = Tolerance { relative: 1e-12, absolute: 1e-12 };
    for native in catalogue::NATIVE.iter().filter(|native| !native.of_own_order) {
        let model =
            catalogue::build(&ModelDef { kind: native.kind.to_owned(), ..ModelDef::default() }).unwrap();
        let spec = model.spec();
        let allowed = closed_step_tolerance(&spec.kind);
        let theta = plausible(spec);
        let (u0, slope) = (vec![30.0; spec.inputs.len()], vec![-12.0; spec.inputs.len()]);
        let segment = Segment {
            t0: 0.2,
            t1: 0.9,
            u0: &u0,
            slope: &slope,
            history: &NoHistory,
            limits: &Limits::none(),
            noise: None,
        };
        let mut exact = vec![0.0; spec.n_state()];
        model.initial(&theta, &mut exact);
        let mut integrated = exact.clone();
        model.advance(segment, &theta, &mut exact).unwrap();
        advance_by::<dyn Model>(&*model, Solver::Dopri5(tolerance), segment, &theta, &mut integrated)
            .unwrap();
        let difference = largest_difference(&exact, &integrated);
        assert!(difference < allowed, "{}: {difference:e}", spec.kind);
    }
}

#[test]
fn outputs_come_in_the_order_in_which_they_are_asked_for() {
    let (mut setup, theta) = setup("oscillator");
    let both = run(&*setup.build().unwrap(), &window(&setup, 3), &theta).outputs;
    setup.outputs = vec!["velocity".to_owned(), "position".to_owned()];
    let swapped = run(&*setup.build().unwrap(), &window(&setup, 3), &theta).outputs;
    assert_eq!(swapped, [both[1], both[0], both[3], both[2], both[5], both[4]]);
    setup.outputs.pop();
    let velocity = run(&*setup.build().unwrap(), &window(&setup, 3), &theta).outputs;
    assert_eq!(velocity, [both[1], both[3], both[5]]);
}

#[test]
fn a_job_that_does_not_fit_is_refused() {
    let (setup, theta) = setup("windkessel-2");
    let model = setup.build().unwrap();
    let good = window(&setup, 4);
    let refused = |window: &starlings_models::Window, theta: &[f64]| {
        let error = model.run(&job(window, theta)).unwrap_err();
        assert!(matches!(error, ParticleError::BadJob(_)), "{error}");
    };
    refused(&good, &theta[..1]);
    refused(&starlings_models::Window { observed: vec![], ..good.clone() }, &theta);
    refused(&starlings_models::Window { inputs: vec![], ..good.clone() }, &theta);
    refused(&starlings_models::Window { start: 0.3, ..good.clone() }, &theta);
    refused(&starlings_models::Window { times: vec![], observed: vec![], ..good.clone() }, &theta);
    let mut backwards = good.clone();
    backwards.times.swap(0, 1);
    refused(&backwards, &theta);
    let mut uneven = good.clone();
    uneven.inputs[0].values.pop();
    refused(&uneven, &theta);
    let mut unsorted = good.clone();
    unsorted.inputs[0].times.swap(3, 4);
    refused(&unsorted, &theta);
    let short = starlings_models::Job { state: Some(vec![].into()), ..job(&good, &theta) };
    assert!(matches!(model.run(&short), Err(ParticleError::BadJob(_))));
}

//! Delays of states and outputs: against closed forms, in windows against one run, inside effects, and refused without bound.

mod common;

use common::{job, largest_difference, run, run_in_pieces, setup, window};
use starlings_models::effect::{Addition, EffectParameter};
use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{
    BuildSetup, EffectDef, ModelDef, ModelFailure, ParticleError, Setup, SetupError, Signal, Window, memory,
};

fn state(name: &str, initial: &str, rate: &str) -> StateDef {
    StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    }
}

fn equations(states: &[(&str, &str, &str)], outputs: &[(&str, &str)], constants: &[(&str, f64)]) -> Setup {
    let output = |(name, value): &(&str, &str)| OutputDef {
        name: (*name).to_owned(),
        value: (*value).to_owned(),
        ..OutputDef::default()
    };
    let equations = EquationsDef {
        states: states.iter().map(|(name, initial, rate)| state(name, initial, rate)).collect(),
        outputs: outputs.iter().map(output).collect(),
        ..EquationsDef::default()
    };
    let constants = constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let model = ModelDef {
        kind: "equations".to_owned(),
        equations: Some(equations),
        constants,
        ..ModelDef::default()
    };
    Setup { model, outputs: outputs.iter().map(|(name, _)| (*name).to_owned()).collect(), ..Setup::default() }
}

/// A free run from `start` with `n` observation times `every` apart.
fn free(setup: &Setup, start: f64, n: usize, every: f64) -> Window {
    let times: Vec<f64> = (1..=n).map(|i| start + i as f64 * every).collect();
    Window::free(start, times, setup.outputs.len(), vec![])
}

/// x' = −x(t − τ) with x = 1 before 0: Σₖ (−1)ᵏ (t − (k − 1) τ)ᵏ/k! over the k with a positive base.
fn hutchinson(t: f64, tau: f64) -> f64 {
    let (mut sum, mut factorial) = (1.0, 1.0);
    for k in 1..40 {
        let base = t - f64::from(k - 1) * tau;
        if base <= 0.0 {
            break;
        }
        factorial *= f64::from(k);
        sum += (-1.0_f64).powi(k) * base.powi(k) / factorial;
    }
    sum
}

#[test]
fn a_delayed_feedback_follows_the_method_of_steps() {
    for tau in [1.0, 0.731] {
        let setup = equations(&[("x", "1", "-delay(x, tau)")], &[("x", "x")], &[("tau", tau)]);
        let model = setup.build().unwrap();
        let window = free(&setup, 0.0, 50, 0.1);
        let want: Vec<f64> = window.times.iter().map(|&t| hutchinson(t, tau)).collect();
        let whole = run(&*model, &window, &[]);
        let error = largest_difference(&whole.outputs, &want);
        // Cubics between knots 1/124 apart, and the solver's 1e-8 per step, which short steps far outdo.
        assert!(error < 1e-9, "τ = {tau}: {error:e}");
        for every in [1, 3, 7] {
            let pieces = run_in_pieces(&*model, &window, &[], every);
            let error = largest_difference(&pieces.outputs, &whole.outputs);
            assert!(error < 1e-9, "τ = {tau}, {every} times each: {error:e}");
        }
    }
}

#[test]
fn a_delay_far_below_its_bound_and_down_to_zero_is_still_followed() {
    let setup = equations(&[("x", "1", "-delay(x, min(tau, 1))")], &[("x", "x")], &[]);
    let setup = Setup { parameters: vec!["tau".to_owned()], ..setup };
    let model = setup.build().unwrap();
    let window = free(&setup, 0.0, 20, 0.1);
    for tau in [0.3, 0.05, 1e-3, 1e-9, 0.0] {
        let want: Vec<f64> = if tau < 1e-2 {
            // x = A e^(−λt) with λ = e^(λτ) but for the first moments, which count τ² of the change of slope.
            let lambda = (0..50).fold(1.0_f64, |l, _| (l * tau).exp());
            window.times.iter().map(|t| (-lambda * t).exp() * (1.0 + 0.5 * tau * tau)).collect()
        } else {
            window.times.iter().map(|&t| hutchinson(t, tau)).collect()
        };
        let error = largest_difference(&run(&*model, &window, &[tau]).outputs, &want);
        // The asymptotic form leaves out terms of τ²: 1e-6 of the first moments.
        assert!(error < 1e-6, "τ = {tau}: {error:e}");
    }
    for tau in [-0.1, f64::NAN] {
        assert!(
            matches!(
                model.run(&job(&window, &[tau])),
                Err(ParticleError::Model(ModelFailure::NotFinite { .. }))
            ),
            "{tau}"
        );
    }
}

#[test]
fn a_delayed_sinusoid_is_the_sinusoid_of_then() {
    // position = cos 3t from the unit oscillator; before the start it was 1.
    let states = [("x", "1", "v"), ("v", "0", "-9*x")];
    let outputs = [("position", "x"), ("late", "delay(position, 0.7)"), ("speed", "ddt(late)")];
    let setup = equations(&states, &outputs, &[]);
    let model = setup.build().unwrap();
    for start in [0.0, -17.3] {
        let window = free(&setup, start, 90, 0.037);
        let then = |t: f64| (t - start - 0.7).max(0.0);
        let want: Vec<f64> = window.times.iter().map(|&t| (3.0 * then(t)).cos()).collect();
        let speed: Vec<f64> = window.times.iter().map(|&t| -3.0 * (3.0 * then(t)).sin()).collect();
        for every in [1, 4, 90] {
            let got = run_in_pieces(&*model, &window, &[], every).outputs;
            let rows = |row: usize| got.iter().copied().skip(row).step_by(3).collect::<Vec<f64>>();
            for (i, t) in window.times.iter().enumerate() {
                // Where the recording begins the curvature jumps by 9, between two knots h = 0.7/124 apart: a part of 9 h² in
                // the value and of 9 h in the slope. Elsewhere cubics err by some h⁴ and h³ times a fourth derivative of 81.
                let near = (t - start - 0.7).abs() < 2.0 * 0.7 / 124.0;
                let allowed = if near { [2e-6, 5e-3] } else { [1e-8, 5e-6] };
                let (late, slope) = (rows(1)[i] - want[i], rows(2)[i] - speed[i]);
                let told = format!("from {start}, {every} times each, at {t}: {late:e}, {slope:e}");
                assert!(late.abs() < allowed[0] && slope.abs() < allowed[1], "{told}");
            }
        }
    }
}

#[test]
fn a_memory_is_one_quantity_of_the_state_and_its_parts_recombine() {
    let setup = equations(&[("x", "x0", "-delay(x, 0.5)")], &[("y", "2*x")], &[]);
    let setup = Setup { parameters: vec!["x0".to_owned()], ..setup };
    let spec = setup.spec().unwrap();
    let names: Vec<&str> = spec.states.iter().map(|q| q.name.as_str()).collect();
    assert_eq!(names, ["x", "delay:x"]);
    assert_eq!(spec.n_state(), 1 + memory::SAMPLES);
    // The equation is linear: the mean of two states goes on as the mean of two runs.
    let model = setup.build().unwrap();
    assert_eq!(model.spec(), &spec);
    let (first, second) = (free(&setup, 0.0, 3, 0.11), free(&setup, 0.33, 5, 0.09));
    let [a, b] = [1.0, 3.0].map(|x0| run(&*model, &first, &[x0]).state);
    let go_on = |state: starlings_models::StateValues| {
        let job = starlings_models::Job { state: Some(state), ..job(&second, &[0.0]) };
        model.run(&job).unwrap().outputs
    };
    let mean: starlings_models::StateValues = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
    let (of_mean, of_a, of_b) = (go_on(mean), go_on(a), go_on(b));
    let mean_of: Vec<f64> = of_a.iter().zip(&of_b).map(|(a, b)| 0.5 * (a + b)).collect();
    // The integrator's tolerance of 1e-8 per step, at other steps.
    assert!(largest_difference(&of_mean, &mean_of) < 1e-7, "{:e}", largest_difference(&of_mean, &mean_of));
}

#[test]
fn a_memory_of_a_memory_starts_from_a_constant_too() {
    let outputs = [("y", "2*x"), ("once", "1 + delay(y, 0.2)"), ("twice", "delay(once, 0.3)")];
    let setup = equations(&[("x", "1", "-x")], &outputs, &[]);
    let window = free(&setup, 0.0, 20, 0.05);
    let want: Vec<f64> = window.times.iter().map(|t| 1.0 + 2.0 * (0.5 - t).min(0.0).exp()).collect();
    let model = setup.build().unwrap();
    for every in [1, 20] {
        let got = run_in_pieces(&*model, &window, &[], every).outputs;
        let twice: Vec<f64> = got.into_iter().skip(2).step_by(3).collect();
        // The kink at 0.2 of `once` lies on no knot of its own memory: a small part of spacing × slope, 0.3/124 × 2.
        assert!(largest_difference(&twice, &want) < 1e-3, "{:e}", largest_difference(&twice, &want));
        let last = twice.len() - 1;
        assert!((twice[last] - want[last]).abs() < 1e-7, "{:e}", twice[last] - want[last]);
    }
}

/// A sensor that answers late: y + a (y(t − τ) − y).
fn late_sensor(term: &str, range: [f64; 2]) -> EffectDef {
    let parameter =
        |name: &str, range| EffectParameter { name: name.to_owned(), range, ..EffectParameter::default() };
    EffectDef {
        name: "late sensor".to_owned(),
        adds: vec![Addition { to: "pressure".to_owned(), term: term.to_owned() }],
        parameters: vec![parameter("a", [0.0, 1.0]), parameter("tau", range)],
        ..EffectDef::default()
    }
}

#[test]
fn a_late_sensor_shows_the_output_of_then() {
    let (setup, theta) = setup("windkessel-3");
    let mut window = window(&setup, 50);
    let plain = run(&*setup.build().unwrap(), &window, &theta).outputs;
    let mut late =
        Setup { effects: vec![late_sensor("a*(delay(pressure, tau) - pressure)", [0.0, 0.5])], ..setup };
    late.parameters.extend(["a".to_owned(), "tau".to_owned()]);
    let model = late.build().unwrap();
    let values = |a: f64, tau: f64| [&theta[..], &[a, tau]].concat();
    let got = run(&*model, &window, &values(1.0, 0.1)).outputs;
    // Five steps of 0.02. The native step is exact, and within one run every stretch between samples is recorded.
    assert!(
        largest_difference(&got[5..], &plain[..45]) < 1e-11,
        "{:e}",
        largest_difference(&got[5..], &plain[..45])
    );
    // In windows, kinks of the flow between knots leave a part of spacing × slope, 0.5/124 × 40·9·Zc.
    let pieces = run_in_pieces(&*model, &window, &values(1.0, 0.1), 7).outputs;
    assert!(largest_difference(&pieces, &got) < 2e-1, "{:e}", largest_difference(&pieces, &got));
    let absent = run(&*model, &window, &values(0.0, 0.1)).outputs;
    assert!(largest_difference(&absent, &plain) < 1e-11, "the same exact steps, cut at knots");
    let beyond = model.run(&job(&window, &values(1.0, 0.6)));
    assert!(
        matches!(beyond, Err(ParticleError::Model(ModelFailure::NotFinite { .. }))),
        "nothing is remembered beyond the range: {beyond:?}"
    );
    // A flow without kinks leaves nothing but rounding and the cubics' error.
    window.inputs[0] = Signal { times: vec![-1.0, 2.0], values: vec![10.0, 40.0] };
    let plain = run(&*late.build().unwrap(), &window, &values(0.0, 0.1)).outputs;
    let got = run(&*model, &window, &values(1.0, 0.1));
    assert!(largest_difference(&got.outputs[5..], &plain[..45]) < 1e-8);
    let pieces = run_in_pieces(&*model, &window, &values(1.0, 0.1), 7);
    assert!(largest_difference(&pieces.outputs, &got.outputs) < 1e-7);
    assert_eq!(pieces.state.len(), got.state.len());
}

#[test]
fn an_effect_feeds_back_late_into_a_rate_of_an_equations_model_with_a_delay_of_its_own() {
    let mut setup = equations(&[("p", "1", "-0.5*delay(p, 1)")], &[("pressure", "2*p")], &[]);
    let mut feedback = late_sensor("a*delay(pressure, tau)", [0.0, 1.0]);
    feedback.adds[0].to = "p".to_owned();
    setup.effects.push(feedback);
    setup.parameters = vec!["a".to_owned(), "tau".to_owned()];
    let spec = setup.spec().unwrap();
    assert_eq!(
        spec.states.iter().map(|q| q.name.as_str()).collect::<Vec<_>>(),
        ["p", "delay:p", "delay:pressure"]
    );
    let window = free(&setup, 0.0, 40, 0.1);
    // −0.5 p(t − 1) − 0.25·2 p(t − 1) = −p(t − 1).
    let got = run(&*setup.build().unwrap(), &window, &[-0.25, 1.0]).outputs;
    let want: Vec<f64> = window.times.iter().map(|&t| 2.0 * hutchinson(t, 1.0)).collect();
    assert!(largest_difference(&got, &want) < 1e-9, "{:e}", largest_difference(&got, &want));
}

#[test]
fn an_output_that_depends_on_an_input_starts_from_its_value_at_the_start() {
    let mut setup = equations(&[("x", "0", "0")], &[("y", "x + u"), ("late", "delay(y, 1)")], &[]);
    let input = InputDef { name: "u".to_owned(), ..InputDef::default() };
    setup.model.equations.as_mut().unwrap().inputs.push(input);
    let mut window = free(&setup, 2.0, 20, 0.1);
    window.inputs.push(Signal { times: vec![0.0, 10.0], values: vec![0.0, 100.0] });
    let got = run_in_pieces(&*setup.build().unwrap(), &window, &[], 3).outputs;
    let want: Vec<f64> = window.times.iter().flat_map(|t| [10.0 * t, 10.0 * (t - 1.0).max(2.0)]).collect();
    assert!(largest_difference(&got, &want) < 1e-9, "{:e}", largest_difference(&got, &want));
}

#[test]
fn a_delay_without_bound_says_how_to_bound_it() {
    let fault = |setup: &Setup| match setup.build().map(|_| ()).expect_err("no bound") {
        SetupError::Expression { column, message, .. } => (column, message),
        other => panic!("{other}"),
    };
    let mut free = equations(&[("x", "1", "-delay(x, tau)")], &[("x", "x")], &[]);
    free.parameters.push("tau".to_owned());
    let (column, message) = fault(&free);
    assert_eq!(column, 8);
    assert!(message.contains("`min(tau, 0.5)`"), "{message}");
    let (windkessel, _) = setup("windkessel-2");
    let open = late_sensor("a*(delay(pressure, tau) - pressure)", [0.0, f64::INFINITY]);
    let (column, message) = fault(&Setup { effects: vec![open], ..windkessel });
    assert_eq!(column, 10);
    assert!(message.contains("finite range"), "{message}");
    let itself = equations(&[("x", "1", "-x")], &[("y", "x + delay(y, 1)")], &[]);
    assert!(fault(&itself).1.contains("would depend on itself"));
}

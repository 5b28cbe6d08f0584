//! Direct state feedback, or nudging (Hoke & Anthes 1976; Moireau, Chapelle & Le Tallec 2008): each observed output pulls
//! the state that it measures.
//!
//! The continuous observer adds γ Σ (z − y) to the rate of the measured state, the sum over its channels. Over the time Δt
//! since the previous observation its exact solution with a held model multiplies the innovation by 1 − e^(−γΔt). Where the
//! output is h times the state, the state's error is left with the factor 1 − h(1 − e^(−γΔt)): any gain is stable for
//! 0 < h ≤ 2, and no gain for a negative h; beyond 2 it must keep γΔt < ln(h/(h − 2)). What a model says of its own outputs
//! is h = 1; a definition's `corrects` may say anything, and h is not checked: it may depend on what is estimated. The
//! explicit form would need γ Δt < 2 already at h = 1. On noise-free data of the true model the innovation is zero and neither
//! the state nor an estimate moves with the gain. Next file to read: [`crate::simulator`].

use nalgebra::DMatrix;

use super::measured::{Measured, mean_innovation, measured};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::SetupError;
use crate::setup::ObserverDef;

/// Pulls measured states towards the data.
#[derive(Debug)]
pub(crate) struct Nudging {
    gain: f64,
    /// Per corrected state component: its position and the rows that measure it.
    channels: Vec<(usize, Vec<usize>)>,
}

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "nudging",
    says: "Each observed output pulls the state that it measures towards the data.",
    build: |def, wiring| Ok(Box::new(Nudging::new(def, wiring)?)),
};

impl Nudging {
    /// Finds the state of every observed output: the definition's `corrects` first, then the model's own `measures`.
    ///
    /// # Errors
    /// When a name in `corrects` is unknown, the sizes of output and state differ, or no channel corrects a state.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        let mut channels: Vec<(usize, Vec<usize>)> = Vec::new();
        for Measured { row, state } in measured(def, &wiring)? {
            match channels.iter_mut().find(|(at, _)| *at == state) {
                Some((_, rows)) => rows.push(row),
                None => channels.push((state, vec![row])),
            }
        }
        if channels.is_empty() {
            return Err(SetupError::Invalid(format!(
                "the observer `nudging` corrects nothing: no observed output of `{}` measures a state; \
                 say which in `corrects`, as output = state",
                wiring.spec.kind
            )));
        }
        Ok(Self { gain: def.gain, channels })
    }
}

impl Observer for Nudging {
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        for (state, rows) in &self.channels {
            if let Some((innovation, n)) = mean_innovation(&at, rows) {
                // n channels pull n times as fast, towards the mean of their innovations.
                x[*state] += -(-f64::from(n) * self.gain * at.dt).exp_m1() * innovation;
            }
        }
    }

    fn feedback(&self, model: &dyn Model, _theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let mut feedback = DMatrix::zeros(n, n);
        for (state, rows) in &self.channels {
            feedback[(*state, *state)] = rows.len() as f64 * self.gain;
        }
        feedback
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;
    use crate::NativeModels;
    use crate::equations::{EquationsDef, EquationsModel, OutputDef, StateDef};

    /// A model whose outputs each show one state: names of outputs and states.
    fn showing(list: &[(&str, &str)]) -> EquationsModel {
        let state = |&(_, name): &(&str, &str)| StateDef {
            name: name.to_owned(),
            initial: "1".to_owned(),
            rate: vec![(name.to_owned(), format!("-{name}"))],
            ..StateDef::default()
        };
        let output = |&(name, value): &(&str, &str)| OutputDef {
            name: name.to_owned(),
            value: value.to_owned(),
            ..OutputDef::default()
        };
        let (states, outputs) = (list.iter().map(state).collect(), list.iter().map(output).collect());
        EquationsModel::new(&EquationsDef { states, outputs, ..EquationsDef::default() }).expect("a model")
    }

    fn vessel() -> EquationsModel {
        showing(&[("pressure", "p")])
    }

    fn oscillator() -> EquationsModel {
        showing(&[("position", "x"), ("velocity", "v")])
    }

    fn def(gain: f64) -> ObserverDef {
        ObserverDef { kind: "nudging".to_owned(), gain, ..ObserverDef::default() }
    }

    fn wiring<'a>(model: &'a dyn Model, outputs: &'a [String]) -> Wiring<'a> {
        Wiring { spec: model.spec(), outputs, model, theta: &[], native: NativeModels::NONE }
    }

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|&s| s.to_owned()).collect()
    }

    #[test]
    fn the_pull_is_one_minus_exp_of_gain_times_time() {
        let model = vessel();
        let outputs = names(&["pressure"]);
        let observer = Nudging::new(&def(2.0), wiring(&model, &outputs)).expect("nudging");
        let mut x = [80.0];
        observer.correct(
            Correction { t: 1.0, dt: 0.3, observed: &[100.0], predicted: &[90.0], model: &model, theta: &[] },
            &mut x,
        );
        // The same arithmetic written out; one rounding apart.
        assert!((x[0] - (80.0 + (1.0 - (-0.6_f64).exp()) * 10.0)).abs() < 1e-13, "{}", x[0]);
    }

    #[test]
    fn a_missing_value_corrects_nothing_and_a_huge_gain_is_stable() {
        let model = oscillator();
        let outputs = names(&["velocity", "position"]);
        let observer = Nudging::new(&def(1e9), wiring(&model, &outputs)).expect("nudging");
        let mut x = [1.0, 2.0];
        let at = Correction {
            t: 1.0,
            dt: 0.1,
            observed: &[f64::NAN, 5.0],
            predicted: &[2.0, 1.0],
            model: &model,
            theta: &[],
        };
        observer.correct(at, &mut x);
        assert_eq!(x, [5.0, 2.0]);
    }

    #[test]
    fn an_output_of_three_times_the_state_is_stable_below_the_logarithm_of_three() {
        let model = vessel();
        let outputs = names(&["pressure"]);
        // What a correction leaves of an error of one in the state, the datum being 3·10.
        let left = |gain: f64| {
            let observer = Nudging::new(&def(gain), wiring(&model, &outputs)).expect("nudging");
            let mut x = [11.0];
            let (observed, predicted) = ([30.0], [33.0]);
            let at = Correction {
                t: 1.0,
                dt: 1.0,
                observed: &observed,
                predicted: &predicted,
                model: &model,
                theta: &[],
            };
            observer.correct(at, &mut x);
            x[0] - 10.0
        };
        // 1 − 3(1 − 3⁻¹) = −1 at γΔt = ln 3; the error turns over and shrinks below, and grows beyond.
        let bound = 3.0_f64.ln();
        assert!(left(0.99 * bound) > -1.0 && left(0.99 * bound) < -0.9, "{}", left(0.99 * bound));
        assert!(left(1.01 * bound) < -1.0, "{}", left(1.01 * bound));
    }

    #[test]
    fn two_channels_of_one_state_pull_twice_as_fast_towards_their_mean() {
        let model = oscillator();
        let outputs = names(&["position", "velocity"]);
        let mut def = def(1.0);
        def.corrects.insert("velocity".to_owned(), "x".to_owned());
        let observer = Nudging::new(&def, wiring(&model, &outputs)).expect("nudging");
        let mut x = [0.0, 0.0];
        observer.correct(
            Correction {
                t: 0.5,
                dt: 0.5,
                observed: &[1.0, 3.0],
                predicted: &[0.0, 0.0],
                model: &model,
                theta: &[],
            },
            &mut x,
        );
        assert!((x[0] - 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-15, "{}", x[0]);
    }

    #[test]
    fn an_unknown_name_in_corrects_offers_the_nearest() {
        let model = oscillator();
        let outputs = names(&["position"]);
        let mut def = def(1.0);
        def.corrects.insert("positon".to_owned(), "x".to_owned());
        let error = Nudging::new(&def, wiring(&model, &outputs)).expect_err("typo");
        assert!(error.to_string().contains("did you mean `position`"), "{error}");
    }

    #[test]
    fn a_model_without_measured_states_is_refused() {
        let model = oscillator();
        let mut spec = model.spec().clone();
        spec.measures.clear();
        let outputs = names(&["position"]);
        let error = Nudging::new(&def(1.0), Wiring { spec: &spec, ..wiring(&model, &outputs) })
            .expect_err("no state");
        assert!(error.to_string().contains("corrects nothing"), "{error}");
    }
}

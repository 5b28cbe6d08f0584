//! Whether two effects are one effect under two names.
//!
//! Next file to read: [`super::candidate`].

use starlings_models::equations::{At, Expression, Program, Slot};
use starlings_models::{Drive, EffectDef};

/// Points at which terms are compared: two different functions of a formula's length agree at so many by accident never.
const POINTS: usize = 16;
/// Relative difference of two values that rounding makes.
const ROUNDING: f64 = 1e-9;
/// Values of every second point over those of the others: an exponential of a temperature has a value at one of the two.
const LARGE: f64 = 300.0;
/// Points at least at which both terms must have a value to be told equal.
const TOLD: usize = 3;

/// Whether two effects add the same functions to the same quantities, whatever their parameters and states are called and up to a
/// factor on the amplitude, which is the same for all of their terms.
pub(crate) fn same_form(a: &EffectDef, b: &EffectDef) -> bool {
    let mut known: Vec<String> = Vec::new();
    let (Some(a), Some(b)) = (Terms::of(a, &mut known), Terms::of(b, &mut known)) else { return false };
    let places = |terms: &Terms| terms.adds.iter().map(|(to, _)| to.clone()).collect::<Vec<_>>();
    if places(&a) != places(&b) || a.n_own != b.n_own || a.states.len() != b.states.len() {
        return false;
    }
    let n = a.n_own + known.len();
    let points: Vec<Vec<f64>> = (0..POINTS).map(|k| point(k, n)).collect();
    let of = |terms: &[&Program]| -> Vec<f64> {
        points.iter().flat_map(|p| terms.iter().map(|term| value(term, p)).collect::<Vec<_>>()).collect()
    };
    let adds = |terms: &Terms| of(&terms.adds.iter().map(|(_, term)| term).collect::<Vec<_>>());
    let states = |terms: &Terms| of(&terms.states.iter().collect::<Vec<_>>());
    let (left, right) = (adds(&a), adds(&b));
    let has_value = |v: f64| v.abs() > 0.0 && v.is_finite();
    let both: Vec<f64> = left
        .iter()
        .zip(&right)
        .filter(|(l, r)| has_value(**l) && has_value(**r))
        .map(|(l, r)| r / l)
        .collect();
    let Some(factor) = both.first().copied().filter(|_| both.len() >= TOLD) else { return false };
    equal(&left, &right, factor) && equal(&states(&a), &states(&b), 1.0)
}

/// Whether the second values are the first times a factor.
fn equal(a: &[f64], b: &[f64], factor: f64) -> bool {
    // A root of a negative number, and what overflows, is one of both.
    let is_equal = |a: f64, b: f64| {
        if a.is_finite() && b.is_finite() {
            (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
        } else {
            !a.is_finite() && !b.is_finite()
        }
    };
    a.iter().zip(b).all(|(a, b)| is_equal(a * factor, *b))
}

/// Numbers of both signs between 0.3 and 1.9, [`LARGE`] times that at every second point, without a pattern (the golden ratio's multiples).
fn point(k: usize, n: usize) -> Vec<f64> {
    let number = |j: usize| {
        let turn = (0.618_033_988_75 * (1 + j + k * (n + 1)) as f64).fract();
        let size = (0.3 + 1.6 * turn) * if k % 2 == 1 { LARGE } else { 1.0 };
        if (j + k) % 3 == 2 { -size } else { size }
    };
    // The amplitude is one.
    (0..n).map(|j| if j == 0 { 1.0 } else { number(j) }).collect()
}

fn value(term: &Program, values: &[f64]) -> f64 {
    let t = values.iter().sum::<f64>().abs();
    term.eval(&At { t, x: &[], theta: values, u: Drive::NONE, y: &[] })
}

/// The terms of an effect, whose names are numbers: its own parameters and states first.
struct Terms {
    n_own: usize,
    adds: Vec<(String, Program)>,
    /// Rate and initial value of every state of its own.
    states: Vec<Program>,
}

impl Terms {
    /// `known` gives names outside of the effect their numbers.
    fn of(def: &EffectDef, known: &mut Vec<String>) -> Option<Self> {
        let parameters = def.parameters.iter().map(|p| p.name.as_str());
        let own: Vec<&str> = parameters.chain(def.states.iter().map(|s| s.name.as_str())).collect();
        let mut program = |term: &str| {
            let expression = Expression::parse(term).ok()?;
            for (name, _) in expression.names() {
                if !own.contains(&name.as_str()) && !known.contains(&name) {
                    known.push(name);
                }
            }
            let number = |name: &str| {
                let of_own = own.iter().position(|own| *own == name);
                of_own.or_else(|| Some(own.len() + known.iter().position(|known| known == name)?))
            };
            expression.compile(&|name| number(name).map(Slot::Parameter), &|_| None).ok()
        };
        let adds = def.adds.iter().map(|add| Some((add.to.clone(), program(&add.term)?)));
        let adds = adds.collect::<Option<Vec<_>>>()?;
        let of_state = def.states.iter().flat_map(|state| [&state.rate, &state.initial]);
        let states = of_state.map(|term| program(term)).collect::<Option<Vec<_>>>()?;
        Some(Self { n_own: own.len(), adds, states })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::effect::{Addition, EffectParameter, EffectState};

    fn effect(to: &str, term: &str, parameters: &[&str], states: &[(&str, &str)]) -> EffectDef {
        let parameter =
            |name: &&str| EffectParameter { name: (*name).to_owned(), ..EffectParameter::default() };
        let state = |(name, rate): &(&str, &str)| EffectState {
            name: (*name).to_owned(),
            rate: (*rate).to_owned(),
            initial: "0".to_owned(),
            ..EffectState::default()
        };
        EffectDef {
            adds: vec![Addition { to: to.to_owned(), term: term.to_owned() }],
            parameters: parameters.iter().map(parameter).collect(),
            states: states.iter().map(state).collect(),
            ..EffectDef::default()
        }
    }

    #[test]
    fn names_of_parameters_and_states_do_not_make_another_effect() {
        let drag = effect("v", "-c*v*abs(v)", &["c"], &[]);
        assert!(same_form(&drag, &effect("v", "-drag * v*abs( v )", &["drag"], &[])));
        assert!(same_form(&drag, &effect("v", "0.5*rho*v*abs(v)", &["rho"], &[])), "in another unit");
        let leak = effect("h", "-a*sqrt(h)", &["a"], &[]);
        assert!(same_form(&leak, &effect("h", "-1*b*h^0.5", &["b"], &[])), "where it has a value");
        assert!(!same_form(&drag, &effect("v", "-c*v", &["c"], &[])), "another term");
        assert!(!same_form(&drag, &effect("x", "-c*v*abs(v)", &["c"], &[])), "another place");
        assert!(!same_form(&drag, &effect("v", "-c*x*abs(x)", &["c"], &[])), "another signal");
        let heat = effect("T", "b*k*exp(-6000*(1/T - 1/330))*c", &["b"], &[]);
        assert!(
            same_form(&heat, &effect("T", "-a*(-k*exp(-6000*(1/T - 1/330))*c)", &["a"], &[])),
            "Arrhenius (1889)"
        );
        assert!(!same_form(&heat, &effect("T", "a", &["a"], &[])), "a constant");
        assert!(!same_form(&heat, &effect("T", "a*c", &["a"], &[])), "a coupling");
        let late = effect("v", "k*s", &["k", "tau"], &[("s", "(x - s)/tau")]);
        assert!(same_form(&late, &effect("v", "a*z", &["a", "T"], &[("z", "(x - z)/T")])));
        assert!(!same_form(&late, &effect("v", "a*z", &["a", "T"], &[("z", "(v - z)/T")])));
        let broken = effect("v", "c*(", &["c"], &[]);
        assert!(!same_form(&broken, &broken), "what cannot be read is equal to nothing");
    }
}

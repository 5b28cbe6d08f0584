//! Effects that change a spring: a model without one has no place for them, and there they could only imitate what is missing.
//!
//! The library grows them wherever a velocity has its displacement, since roles do not say what a rate depends on; equations do. Next file
//! to read: [`super::candidates`].

use starlings_models::effect::library::stem;
use starlings_models::equations::{EquationsDef, Expression};
use starlings_models::{EffectDef, Role, Spec};
use starlings_study::Study;

/// The kinds of effects that change a spring. A support or a stop may come where there was none.
const OF_A_SPRING: [&str; 3] = ["quadratic-stiffness", "cubic-stiffness", "backlash"];

/// Whether an effect changes a spring and the equations have none: the rate that it adds to depends on no displacement, nor does the rate
/// of anything that it depends on. `false` for a model whose equations are not at hand.
pub(crate) fn lacks_spring(study: &Study, spec: &Spec, effect: &EffectDef) -> bool {
    let Some(equations) = study.setup.model.equations.as_ref() else { return false };
    let effects = &study.setup.effects;
    let is_state = |name: &str| equations.states.iter().any(|state| state.name == name);
    // What an effect in the model remembers, or changes elsewhere, may be a spring too.
    if effects.iter().any(|e| !e.states.is_empty() || e.adds.iter().any(|add| !is_state(&add.to))) {
        return false;
    }
    OF_A_SPRING.contains(&stem(&effect.name))
        && effect.adds.iter().all(|add| {
            let reached = reached(equations, effects, &add.to);
            let states = spec.states.iter().filter(|state| reached.contains(&state.name));
            states.into_iter().all(|state| state.role != Role::Displacement)
        })
}

/// This state and the states and outputs that its rate depends on, through others too, with what these effects add.
fn reached(equations: &EquationsDef, effects: &[EffectDef], state: &str) -> Vec<String> {
    let mut reached = vec![state.to_owned()];
    let mut next = 0;
    while let Some(name) = reached.get(next).cloned() {
        for name in terms(equations, effects, &name).into_iter().flat_map(|term| names(equations, term)) {
            if !reached.contains(&name) {
                reached.push(name);
            }
        }
        next += 1;
    }
    reached
}

/// What the rate of a state is the sum of, or the value of an output.
fn terms<'a>(equations: &'a EquationsDef, effects: &'a [EffectDef], name: &str) -> Vec<&'a str> {
    if let Some(state) = equations.states.iter().find(|state| state.name == name) {
        let added = effects.iter().flat_map(|effect| &effect.adds).filter(|add| add.to == state.name);
        let own = state.rate.iter().map(|(_, term)| term.as_str());
        return own.chain(added.map(|add| add.term.as_str())).collect();
    }
    let outputs = equations.outputs.iter().filter(|output| output.name == name);
    outputs.map(|output| output.value.as_str()).collect()
}

/// The states and outputs that a term names.
fn names(equations: &EquationsDef, term: &str) -> Vec<String> {
    let of_states = equations.states.iter().map(|state| &state.name);
    let known: Vec<&String> = of_states.chain(equations.outputs.iter().map(|output| &output.name)).collect();
    let Ok(term) = Expression::parse(term) else { return Vec::new() };
    term.names().into_iter().map(|(name, _)| name).filter(|name| known.contains(&name)).collect()
}

#[cfg(test)]
mod tests {
    use starlings_models::Addition;
    use starlings_models::equations::{OutputDef, StateDef};

    use super::*;

    /// What the rate of v depends on, of x, v and p with these rates.
    fn of_v(rates: [&str; 3], effects: &[EffectDef]) -> Vec<String> {
        let state = |(name, rate): (&str, &str)| StateDef {
            name: name.to_owned(),
            rate: vec![(name.to_owned(), rate.to_owned())],
            ..StateDef::default()
        };
        let states = ["x", "v", "p"].into_iter().zip(rates).map(state).collect();
        let (name, value) = ("stretch".to_owned(), "x - 0.1".to_owned());
        let outputs = vec![OutputDef { name, value, ..OutputDef::default() }];
        let mut of = reached(&EquationsDef { states, outputs, ..EquationsDef::default() }, effects, "v");
        of.sort_unstable();
        of
    }

    #[test]
    fn a_rate_depends_on_what_the_rates_of_its_states_depend_on() {
        assert_eq!(of_v(["v", "-k*x - c*v", "0"], &[]), ["v", "x"]);
        assert_eq!(of_v(["v", "-9.81 - c*v", "-x"], &[]), ["v"]);
        assert_eq!(of_v(["v", "a*p - c*v", "-p + x"], &[]), ["p", "v", "x"]);
        assert_eq!(of_v(["v", "a*p - c*v", "-p + v"], &[]), ["p", "v"]);
        assert_eq!(of_v(["v", "-k*stretch - c*v", "0"], &[]), ["stretch", "v", "x"]);
    }

    #[test]
    fn an_effect_in_the_model_may_be_the_spring() {
        let adds = vec![Addition { to: "v".to_owned(), term: "-k*x".to_owned() }];
        assert_eq!(of_v(["v", "-c*v", "0"], &[EffectDef { adds, ..EffectDef::default() }]), ["v", "x"]);
    }
}

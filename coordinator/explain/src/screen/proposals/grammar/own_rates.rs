//! Terms made of the rates that the model has: in an equation where they are missing, or changing with a quantity or with time.
//!
//! What a reaction uses up may heat as well, a loss to the surroundings may grow with the wind, and a coefficient may age. What stands in a
//! sum or a function of the model is nowhere else in the grammar; a rate that is a mere product of quantities is left to its products. Next file to
//! read: [`super::super`].

use starlings_models::EffectDef;
use starlings_models::equations::{EquationsDef, Expression};

use crate::fit::same_form::same_form;

use super::{Equation, Signal, coefficient, parameter};

/// A rate of the model.
pub(super) struct OwnRate<'a> {
    /// The state that it moves.
    state: &'a str,
    unit: &'a str,
    name: &'a str,
    text: &'a str,
}

impl OwnRate<'_> {
    /// What it is called in a sentence; a rate that is given as one text has no name of its own.
    fn told(&self) -> String {
        if self.name == self.state { "rate".to_owned() } else { format!("`{}`", self.name) }
    }
}

/// The rates of the states of the grammar in which a quantity stands in a sum or a function. None that reads an output, which is no quantity of
/// the grammar, or a slope or the past, which not every effect may read.
pub(super) fn own_rates<'a>(equations: &'a EquationsDef, signals: &[Signal<'_>]) -> Vec<OwnRate<'a>> {
    let is_of_grammar = |name: &str| signals.iter().any(|s| s.name() == name);
    let moves = |name: &str| {
        equations.states.iter().any(|state| state.name == name)
            || equations.inputs.iter().any(|input| input.name == name)
    };
    let is_output = |name: &str| !moves(name) && equations.outputs.iter().any(|output| output.name == name);
    let is_readable = |rate: &OwnRate<'_>| {
        let Ok(e) = Expression::parse(rate.text) else { return false };
        !e.has_memory() && !e.is_product_in(&moves) && !e.names().iter().any(|(name, _)| is_output(name))
    };
    let states = equations.states.iter().filter(|state| is_of_grammar(&state.name));
    let rates = states.flat_map(|state| {
        state.rate.iter().map(|(name, text)| OwnRate { state: &state.name, unit: &state.unit, name, text })
    });
    rates.filter(is_readable).collect()
}

impl Equation<'_> {
    /// The terms of the model's rates: of another equation as they are, unless this one has the same, and of its own with a factor, which its
    /// coefficient does not have.
    pub(super) fn of_rates(&mut self, rates: &[OwnRate<'_>], signals: &[Signal<'_>]) {
        for rate in rates.iter().filter(|rate| rate.state == self.state.name) {
            self.with_factor(rate, signals);
        }
        let as_it_is = |equation: &Self, rate: &OwnRate<'_>| {
            let says = format!("goes with the {} of {}", rate.told(), rate.state);
            let unit = [(rate.unit, 1.0), (equation.time, -1.0)];
            equation.term("rate-of", &[rate.state, rate.name], &says, (&format!("({})", rate.text), &unit))
        };
        let (own, others): (Vec<&OwnRate<'_>>, Vec<_>) =
            rates.iter().partition(|rate| rate.state == self.state.name);
        let mut known: Vec<EffectDef> = own.into_iter().map(|rate| as_it_is(self, rate)).collect();
        for rate in others {
            let def = as_it_is(self, rate);
            if !known.iter().any(|other| same_form(other, &def)) {
                known.push(def.clone());
                self.made.push(def);
            }
        }
    }

    /// A rate of this equation times a quantity or the time.
    fn with_factor(&mut self, rate: &OwnRate<'_>, signals: &[Signal<'_>]) {
        let OwnRate { unit, name, text, .. } = *rate;
        let own = rate.told();
        for q in signals {
            let says = format!("goes with its {own} times {}", q.name());
            let units = [(unit, 1.0), (self.time, -1.0), (&q.of.unit, 1.0)];
            let term = format!("({text})*{}", q.name());
            let def = self.term("rate-times", &[name, q.name()], &says, (&term, &units));
            self.made.push(def);
        }
        let says = format!("goes with its {own} and grows with time");
        let def = self.term("rate-drift", &[name], &says, (&format!("({text})*t"), &[(unit, 1.0)]));
        self.made.push(def);
    }

    /// A coefficient times a term whose factors have these units with these powers.
    fn term(
        &self,
        stem: &str,
        of: &[&str],
        says: &str,
        (term, factors): (&str, &[(&str, f64)]),
    ) -> EffectDef {
        let told: Vec<&str> = std::iter::once(self.state.name.as_str()).chain(of.iter().copied()).collect();
        let letters = |c: char| if c.is_alphanumeric() { c } else { '_' };
        let amplitude: String = coefficient("k", stem, &told).chars().map(letters).collect();
        let (name, term) = (format!("{stem}:{}", told.join(":")), format!("{amplitude}*{term}"));
        self.def(name, says, term, vec![parameter(&amplitude, self.unit(factors))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::equations::StateDef;
    use starlings_models::{Quantity, Role};

    #[test]
    fn a_rate_enters_another_equation_and_changes_with_a_quantity_in_its_own() {
        let state = |name: &str, unit: &str, rate: &[(&str, &str)]| StateDef {
            name: name.to_owned(),
            unit: unit.to_owned(),
            role: Role::Other,
            rate: rate.iter().map(|(term, text)| ((*term).to_owned(), (*text).to_owned())).collect(),
            ..StateDef::default()
        };
        let equations = EquationsDef {
            states: vec![
                state("c", "mol/L", &[("flow", "-q*c"), ("first order", "-k*exp(-E/T)*c")]),
                state("T", "K", &[("loss", "-u*(T - air)")]),
            ],
            ..EquationsDef::default()
        };
        let of = [Quantity::new("c", "mol/L"), Quantity::new("T", "K"), Quantity::new("wind", "m/s")];
        let signals: Vec<Signal<'_>> = of.iter().map(|of| Signal { of, ends: [1.0, 2.0] }).collect();
        let rates = own_rates(&equations, &signals);
        let mut equation = Equation { state: &of[1], time: "s", made: Vec::new() };
        equation.of_rates(&rates, &signals);
        let told: Vec<[&str; 3]> = equation
            .made
            .iter()
            .map(|def| [def.name.as_str(), def.adds[0].term.as_str(), def.parameters[0].unit.as_str()])
            .collect();
        assert_eq!(
            told,
            [
                ["rate-times:T:loss:c", "k_rate_times_T_loss_c*(-u*(T - air))*c", "L/mol"],
                ["rate-times:T:loss:T", "k_rate_times_T_loss_T*(-u*(T - air))*T", "1/K"],
                ["rate-times:T:loss:wind", "k_rate_times_T_loss_wind*(-u*(T - air))*wind", "s/m"],
                ["rate-drift:T:loss", "k_rate_drift_T_loss*(-u*(T - air))*t", "1/s"],
                ["rate-of:T:c:first order", "k_rate_of_T_c_first_order*(-k*exp(-E/T)*c)", "K L/mol"],
            ]
        );
    }

    #[test]
    fn a_rate_that_two_equations_have_enters_a_third_once_and_neither_of_them() {
        let state = |name: &str, rate: &str| StateDef {
            name: name.to_owned(),
            rate: vec![("conversion".to_owned(), rate.to_owned())],
            ..StateDef::default()
        };
        let equations = EquationsDef {
            states: vec![
                state("a", "-k*exp(-4000/T)*a"),
                state("b", "k*exp(-4000/T)*a"),
                state("T", "u*delay(a, 2) - u*T"),
                state("w", "u*ddt(a) - u*w"),
            ],
            ..EquationsDef::default()
        };
        let of = ["a", "b", "T", "w"].map(|name| Quantity::new(name, ""));
        let signals: Vec<Signal<'_>> = of.iter().map(|of| Signal { of, ends: [1.0, 2.0] }).collect();
        let rates = own_rates(&equations, &signals);
        assert_eq!(rates.len(), 2, "none that reads a slope or the past");
        let terms = |state: &Quantity| {
            let mut equation = Equation { state, time: "s", made: Vec::new() };
            equation.of_rates(&rates, &signals);
            equation
                .made
                .into_iter()
                .map(|def| def.name)
                .filter(|name| name.starts_with("rate-of"))
                .collect::<Vec<_>>()
        };
        assert_eq!(terms(&of[2]), ["rate-of:T:a:conversion"]);
        assert!(terms(&of[0]).is_empty() && terms(&of[1]).is_empty());
    }
}

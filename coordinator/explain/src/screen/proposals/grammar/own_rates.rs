//! Terms made of the rates that the model has: in an equation where they are missing, or changing with a quantity or with time.
//!
//! What a reaction uses up may heat as well, a loss to the surroundings may grow with the wind, and a coefficient may age. A rate that is a
//! product of quantities has these terms in the rest of the grammar, and what is in a sum or a function of the model only here. Next file to
//! read: [`super::super`].

use starlings_models::equations::{EquationsDef, Expression};

use super::{Equation, Signal, coefficient, parameter};

/// A rate of the model.
pub(super) struct OwnRate<'a> {
    /// The state that it moves.
    state: &'a str,
    unit: &'a str,
    name: &'a str,
    text: &'a str,
}

/// The rates that are no mere product of the quantities of the grammar, and move one of these.
pub(super) fn own_rates<'a>(equations: &'a EquationsDef, signals: &[Signal<'a>]) -> Vec<OwnRate<'a>> {
    let moves = |name: &str| signals.iter().any(|s| s.name() == name);
    let states = equations.states.iter().filter(|state| moves(&state.name));
    let rates = states.flat_map(|state| {
        state.rate.iter().map(|(name, text)| OwnRate { state: &state.name, unit: &state.unit, name, text })
    });
    rates.filter(|rate| Expression::parse(rate.text).is_ok_and(|e| !e.is_product_in(&moves))).collect()
}

impl Equation<'_> {
    /// The terms of one rate: in another equation as it is, in its own with a factor, which its coefficient does not have.
    pub(super) fn of_rate(&mut self, rate: &OwnRate<'_>, signals: &[Signal<'_>]) {
        let OwnRate { state, unit, name, text } = *rate;
        if state != self.state.name {
            let says = format!("goes with `{name}` of {state}");
            let term = format!("({text})");
            self.add_rate("rate-of", &[state, name], &says, &term, &[(unit, 1.0), (self.time, -1.0)]);
            return;
        }
        for q in signals {
            let says = format!("goes with its `{name}` times {}", q.name());
            let term = format!("({text})*{}", q.name());
            self.add_rate(
                "rate-times",
                &[name, q.name()],
                &says,
                &term,
                &[(unit, 1.0), (self.time, -1.0), (&q.of.unit, 1.0)],
            );
        }
        let says = format!("goes with its `{name}` and grows with time");
        self.add_rate("rate-drift", &[name], &says, &format!("({text})*t"), &[(unit, 1.0)]);
    }

    /// A coefficient times a term whose factors have these units with these powers.
    fn add_rate(&mut self, stem: &str, of: &[&str], says: &str, term: &str, factors: &[(&str, f64)]) {
        let told: Vec<&str> = std::iter::once(self.state.name.as_str()).chain(of.iter().copied()).collect();
        let letters = |c: char| if c.is_alphanumeric() { c } else { '_' };
        let amplitude: String = coefficient("k", stem, &told).chars().map(letters).collect();
        let unit = self.unit(factors);
        let (name, term) = (format!("{stem}:{}", told.join(":")), format!("{amplitude}*{term}"));
        self.push(name, says, term, vec![parameter(&amplitude, unit)]);
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
        for rate in &rates {
            equation.of_rate(rate, &signals);
        }
        let told: Vec<[&str; 3]> = equation
            .made
            .iter()
            .map(|def| [def.name.as_str(), def.adds[0].term.as_str(), def.parameters[0].unit.as_str()])
            .collect();
        assert_eq!(
            told,
            [
                ["rate-of:T:c:first order", "k_rate_of_T_c_first_order*(-k*exp(-E/T)*c)", "K L/mol"],
                ["rate-times:T:loss:c", "k_rate_times_T_loss_c*(-u*(T - air))*c", "L/mol"],
                ["rate-times:T:loss:T", "k_rate_times_T_loss_T*(-u*(T - air))*T", "1/K"],
                ["rate-times:T:loss:wind", "k_rate_times_T_loss_wind*(-u*(T - air))*wind", "s/m"],
                ["rate-drift:T:loss", "k_rate_drift_T_loss*(-u*(T - air))*t", "1/s"],
            ]
        );
    }
}

//! A model written as equations, as plain data.
//!
//! The expressions are not checked here: [`super::EquationsModel::new`] does that. Next file to read: [`super::model`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::expression::Expression;
use crate::{Role, SetupError, nearest};

/// The equations of a model, as a study states them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EquationsDef {
    /// States, each with its rate.
    pub states: Vec<StateDef>,
    /// Outputs that can be observed.
    pub outputs: Vec<OutputDef>,
    /// Input signals.
    pub inputs: Vec<InputDef>,
    /// Names of rate terms that may be left out or replaced; a name shared by several states stands for all of them.
    pub replaceable: Vec<String>,
    /// Physical meaning of parameters, by name; effects find their place by it. A name that no expression uses is ignored, so
    /// that a term can be left out together with its parameters.
    pub roles: BTreeMap<String, Role>,
    /// How to integrate.
    pub solver: SolverDef,
}

impl EquationsDef {
    /// The same equations with the named rate terms left out, wherever they occur.
    ///
    /// # Errors
    /// [`SetupError::Unknown`] for a term that is not replaceable.
    pub fn without(&self, terms: &[&str]) -> Result<Self, SetupError> {
        let mut def = self.clone();
        for term in terms {
            if !self.replaceable.iter().any(|name| name == term) {
                let nearest = nearest(term, &self.replaceable);
                return Err(SetupError::Unknown {
                    what: "replaceable term",
                    name: (*term).to_owned(),
                    nearest,
                });
            }
            def.replaceable.retain(|name| name != term);
            for state in &mut def.states {
                state.rate.retain(|(name, _)| name != term);
                if state.rate.is_empty() {
                    state.rate.push((state.name.clone(), "0".to_owned()));
                }
            }
        }
        Ok(def)
    }

    /// The parameters among these names to which the rates are proportional, up to terms without them, and which nothing else has: what
    /// the model does changes with such a parameter itself more evenly than with its logarithm.
    pub fn linear_in<'n>(&self, names: &[&'n str]) -> Vec<&'n str> {
        let parsed = |text: &String| Expression::parse(text).ok();
        let has = |e: &Expression, name: &str| e.names().iter().any(|(known, _)| known == name);
        let elsewhere = self.states.iter().map(|state| &state.initial);
        let elsewhere = elsewhere.chain(self.outputs.iter().map(|output| &output.value));
        let noise = self.states.iter().flat_map(|state| state.noise.iter().map(|(_, amplitude)| amplitude));
        let elsewhere = elsewhere.chain(noise);
        let elsewhere: Vec<Expression> = elsewhere.filter_map(parsed).collect();
        let rates = self.states.iter().flat_map(|state| state.rate.iter().map(|(_, text)| text));
        let rates: Vec<Expression> = rates.filter_map(parsed).collect();
        let is_linear = |name: &&&str| {
            let mut of = rates.iter().filter(|e| has(e, name)).peekable();
            of.peek().is_some() && of.all(|e| e.is_linear_in(name)) && !elsewhere.iter().any(|e| has(e, name))
        };
        names.iter().filter(is_linear).copied().collect()
    }
}

/// One state and its rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StateDef {
    /// Name, unique among all names of the model.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Physical meaning.
    pub role: Role,
    /// Smallest and largest value that physics allows; infinite where it sets no bound.
    #[serde(with = "crate::bounds")]
    pub range: [f64; 2],
    /// Initial value: a number, or an expression of parameters.
    pub initial: String,
    /// Rate as the sum of named terms, (name, expression); a rate given as one text is one term named as the state.
    pub rate: Vec<(String, String)>,
    /// White noise in the rate as a sum over sources, (source, amplitude); an amplitude given as one text is that of a source named
    /// as the state. States that name one source are moved by the same noise. An amplitude has the state's unit per square root of
    /// the time unit.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub noise: Vec<(String, String)>,
}

impl Default for StateDef {
    fn default() -> Self {
        Self {
            name: String::new(),
            unit: String::new(),
            role: Role::Other,
            range: crate::bounds::unbounded(),
            initial: String::new(),
            rate: Vec::new(),
            noise: Vec::new(),
        }
    }
}

/// One output.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OutputDef {
    /// Name; it may be a state's name when the value is that state.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Physical meaning.
    pub role: Role,
    /// Value: an expression.
    pub value: String,
}

/// One input signal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InputDef {
    /// Name, unique among all names of the model.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Physical meaning.
    pub role: Role,
}

/// Which integrator runs the equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Dormand–Prince that goes over to Rosenbrock where the equations turn out stiff.
    #[default]
    Auto,
    /// Dormand–Prince 5(4).
    Dopri5,
    /// Rosenbrock 4(3), for stiff equations.
    Rosenbrock,
    /// Classic Runge–Kutta with a fixed step.
    Fixed,
    /// Heun's method with a fixed step: noise in the sense of Stratonovich.
    Heun,
    /// The method of Euler and Maruyama with a fixed step: noise in the sense of Itô.
    EulerMaruyama,
}

impl Method {
    /// All methods, by the names that a study gives them.
    pub const ALL: [Self; 6] =
        [Self::Auto, Self::Dopri5, Self::Rosenbrock, Self::Fixed, Self::Heun, Self::EulerMaruyama];

    /// Its name in a study.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Dopri5 => "dopri5",
            Self::Rosenbrock => "rosenbrock",
            Self::Fixed => "fixed",
            Self::Heun => "heun",
            Self::EulerMaruyama => "euler-maruyama",
        }
    }

    /// Whether it goes in equal steps, whose length the study states.
    pub fn has_fixed_step(self) -> bool {
        matches!(self, Self::Fixed | Self::Heun | Self::EulerMaruyama)
    }
}

/// How the equations are integrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SolverDef {
    /// The integrator.
    pub method: Method,
    /// Relative tolerance per step.
    pub rtol: f64,
    /// Absolute tolerance per step, in each state's unit.
    pub atol: f64,
    /// Longest step of a method with a fixed step, in the study's time unit.
    pub step: Option<f64>,
}

impl Default for SolverDef {
    fn default() -> Self {
        Self { method: Method::Auto, rtol: 1e-8, atol: 1e-10, step: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_linear_in_what_is_a_factor_of_their_terms_and_stands_nowhere_else() {
        let state = |name: &str, initial: &str, rate: &str| StateDef {
            name: name.to_owned(),
            initial: initial.to_owned(),
            rate: vec![(name.to_owned(), rate.to_owned())],
            ..StateDef::default()
        };
        let shaken = vec![("wind".to_owned(), "0.1*w".to_owned())];
        let states = vec![
            state("x", "x0", "v"),
            StateDef { noise: shaken, ..state("v", "0", "-k*x - c*abs(v)*v/m - x^n + g*s + w") },
        ];
        let outputs =
            vec![OutputDef { name: "y".to_owned(), value: "s*x".to_owned(), ..OutputDef::default() }];
        let def = EquationsDef { states, outputs, ..EquationsDef::default() };
        assert_eq!(def.linear_in(&["k", "c", "m", "n", "g", "s", "w", "x0", "absent"]), ["k", "c", "g"]);
    }
}

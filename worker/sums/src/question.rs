//! From a setup to the functions of its equations and the coefficients that are asked for.
//!
//! The coordinator and every worker make it of the same setup, so that only numbers travel between them. Next file to read:
//! [`super::block_sums`].

use std::sync::Arc;

use starlings_estimators::inference::{Basis, Coefficient, Place, Polynomial, Rule, Structure};
use starlings_models::equations::{Drift, DriftFunction, DriftPlace, EquationsDef};
use starlings_models::{Setup, SumsDef};

use crate::error::SumsError;
use crate::expressions::Expressions;

/// What an inference asks of a recording.
#[derive(Debug, Clone)]
pub struct Question {
    /// The functions, of the model's states and then its inputs.
    pub basis: Arc<Basis>,
    /// Which coefficient enters where.
    pub structure: Structure,
    /// The same with a coefficient for every term that may be missing, behind the others; `None` where none is looked for.
    pub wider: Option<Structure>,
    /// Pairs of neighbouring steps that a block gives at most.
    pub pairs: usize,
}

impl Question {
    /// The question of a setup with [`Setup::sums`].
    ///
    /// # Errors
    /// When the model is none of equations, its rates are not linear in the unknowns, or two functions are one.
    pub fn of(setup: &Setup) -> Result<Self, SumsError> {
        let def = setup.sums.as_deref().ok_or(SumsError::Unasked("the setup asks for no sums"))?;
        let equations = setup.model.equations.as_ref();
        let equations =
            equations.ok_or(SumsError::Unasked("sums are made of a model with `kind = \"equations\"`"))?;
        if def.unknown.is_empty() {
            Self::of_functions(setup, def, equations)
        } else {
            Self::of_rates(setup, def, equations)
        }
    }

    /// The rates of the model, linear in the unknowns.
    fn of_rates(setup: &Setup, def: &SumsDef, equations: &EquationsDef) -> Result<Self, SumsError> {
        let drift = Drift::of_rates(equations, &setup.model.constants, &def.unknown, &def.left)?;
        let names: Vec<String> = drift.functions.iter().map(|function| function.name.clone()).collect();
        let basis = with_expressions(empty(equations), drift.functions, equations.states.len())?;
        let basis = with_candidates(basis, setup, def, equations)?;
        let states = states(equations);
        let mut structure = Structure::new(&basis, &states)?;
        let at = |place: &DriftPlace| (states[place.equation], names[place.function].as_str(), place.factor);
        for place in &drift.known {
            let (equation, function, factor) = at(place);
            structure = structure.known(equation, function, factor)?;
        }
        for (name, places) in def.unknown.iter().zip(&drift.places) {
            let places: Vec<_> = places.iter().map(at).collect();
            structure = structure.with(name, &places)?;
        }
        Self::new(basis, structure, def)
    }

    /// The same functions in every equation.
    fn of_functions(setup: &Setup, def: &SumsDef, equations: &EquationsDef) -> Result<Self, SumsError> {
        let states = states(equations);
        let mut basis = empty(equations);
        if let Some(polynomial) = def.polynomial {
            let all: Vec<usize> = (0..states.len()).collect();
            let family = Polynomial::new(&states, states.len(), &all, polynomial.degree, polynomial.constant);
            let left = !states.is_empty() && states.iter().all(|state| def.left.iter().any(|l| l == state));
            basis = basis.with(if left { Rule::LeftPoint } else { Rule::MidPoint }, family)?;
        }
        let functions = Drift::of_texts(equations, &setup.model.constants, &def.functions, &def.left)?;
        let basis = with_expressions(basis, functions, states.len())?;
        let own = basis.names().to_vec();
        let own: Vec<&str> = own.iter().map(String::as_str).collect();
        let basis = with_candidates(basis, setup, def, equations)?;
        let structure = Structure::by_equation(&basis, &states, &vec![own.as_slice(); states.len()])?;
        Self::new(basis, structure, def)
    }

    /// With a coefficient for every candidate in every equation that has not this function with a coefficient of its own.
    fn new(basis: Basis, structure: Structure, def: &SumsDef) -> Result<Self, SumsError> {
        let mut wider = structure.clone();
        for (l, equation) in structure.equations().iter().enumerate() {
            for function in &def.candidates {
                let at = |place: &Place| place.equation == l && basis.index(function) == Some(place.function);
                let has = |c: &Coefficient| matches!(c.places.as_slice(), [place] if at(place));
                if !structure.coefficients().iter().any(has) {
                    let name = format!("{equation}:{function}");
                    wider = wider.with(&name, &[(equation, function, 1.0)])?;
                }
            }
        }
        let wider = (!def.candidates.is_empty()).then_some(wider);
        let pairs = def.pairs.unwrap_or(usize::MAX);
        Ok(Self { basis: Arc::new(basis), structure, wider, pairs })
    }
}

/// With the functions of candidates that it has not by the same name.
fn with_candidates(
    basis: Basis,
    setup: &Setup,
    def: &SumsDef,
    equations: &EquationsDef,
) -> Result<Basis, SumsError> {
    let new = def.candidates.iter().filter(|text| basis.index(text).is_none());
    let new: Vec<String> = new.cloned().collect();
    let functions = Drift::of_texts(equations, &setup.model.constants, &new, &def.left)?;
    with_expressions(basis, functions, equations.states.len())
}

fn states(equations: &EquationsDef) -> Vec<&str> {
    equations.states.iter().map(|state| state.name.as_str()).collect()
}

fn empty(equations: &EquationsDef) -> Basis {
    Basis::new(equations.states.len(), equations.inputs.len())
}

/// With functions in their order, those in a row that are taken at one point together.
fn with_expressions(
    mut basis: Basis,
    functions: Vec<DriftFunction>,
    n_state: usize,
) -> Result<Basis, SumsError> {
    let mut rest = functions.into_iter().peekable();
    while let Some(first) = rest.next() {
        let left = first.left;
        let mut together = vec![first];
        while let Some(next) = rest.next_if(|function| function.left == left) {
            together.push(next);
        }
        let rule = if left { Rule::LeftPoint } else { Rule::MidPoint };
        basis = basis.with(rule, Expressions { functions: together, n_state })?;
    }
    Ok(basis)
}

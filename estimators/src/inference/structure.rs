//! Which functions enter which equations, with which unknown and known coefficients.
//!
//! The drift is f = C φ with C of L x B linear in the P unknowns: C = C₀ + Σ c_p S_p. The same functions in every equation,
//! functions of every equation's own, coefficients that several equations share and terms that are known are all of this form,
//! so sums of one pass through the data serve all of them. (A general f = F(x, t) c of eq. 1.7 has F_lp = Σ_b S_p,lb φ_b.)
//! Read next: `normal.rs`, the equations for c.

use nalgebra::DMatrix;

use super::{Basis, InferenceError};

/// A place where a coefficient enters: an equation, a function, and the factor it is multiplied by.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Equation, from 0.
    pub equation: usize,
    /// Function, from 0.
    pub function: usize,
    /// Factor, as −1 for what leaves a tank.
    pub factor: f64,
}

/// One unknown coefficient.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// Its name.
    pub name: String,
    /// Where it enters, at least once.
    pub places: Vec<Place>,
}

/// L equations over B functions with P unknown coefficients.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Structure {
    equations: Vec<String>,
    functions: Vec<String>,
    coefficients: Vec<Coefficient>,
    #[serde(with = "super::text::matrix")]
    known: DMatrix<f64>,
}

impl Structure {
    /// Equations of these names, one per state, without any term yet.
    ///
    /// # Errors
    /// `Shape`.
    pub fn new(basis: &Basis, equations: &[&str]) -> Result<Self, InferenceError> {
        if equations.len() != basis.n_state() {
            let (expected, got) = (basis.n_state(), equations.len());
            return Err(InferenceError::Shape { what: "equations", expected, got });
        }
        Ok(Self {
            equations: equations.iter().map(|e| (*e).to_owned()).collect(),
            functions: basis.names().to_vec(),
            coefficients: Vec::new(),
            known: DMatrix::zeros(equations.len(), basis.n_function()),
        })
    }

    /// Every function in every equation, equation after equation; coefficients are named `x1:x1*x2`.
    ///
    /// # Errors
    /// `Shape`.
    pub fn same(basis: &Basis, equations: &[&str]) -> Result<Self, InferenceError> {
        let all: Vec<&str> = basis.names().iter().map(String::as_str).collect();
        Self::by_equation(basis, equations, &vec![all.as_slice(); equations.len()])
    }

    /// The named functions in each equation, a coefficient each.
    ///
    /// # Errors
    /// `Shape`, and as for [`Structure::with`].
    pub fn by_equation(
        basis: &Basis,
        equations: &[&str],
        functions: &[&[&str]],
    ) -> Result<Self, InferenceError> {
        let mut structure = Self::new(basis, equations)?;
        if functions.len() != equations.len() {
            let (expected, got) = (equations.len(), functions.len());
            return Err(InferenceError::Shape { what: "lists of functions", expected, got });
        }
        for (equation, functions) in equations.iter().zip(functions) {
            for function in *functions {
                let name = format!("{equation}:{function}");
                structure = structure.with(&name, &[(equation, function, 1.0)])?;
            }
        }
        Ok(structure)
    }

    /// With one more unknown coefficient, which enters at every place (equation, function, factor).
    ///
    /// # Errors
    /// `RepeatedName`; `Unknown` equation or function; `Shape` for no place at all; `Overflow` for a factor that is
    /// not finite.
    pub fn with(mut self, name: &str, places: &[(&str, &str, f64)]) -> Result<Self, InferenceError> {
        if self.coefficients.iter().any(|c| c.name == name) {
            return Err(InferenceError::RepeatedName { name: name.into() });
        }
        if places.is_empty() {
            return Err(InferenceError::Shape { what: "places of a coefficient", expected: 1, got: 0 });
        }
        let places = places.iter().map(|(e, f, factor)| self.place(e, f, *factor));
        let places = places.collect::<Result<_, _>>()?;
        self.coefficients.push(Coefficient { name: name.into(), places });
        Ok(self)
    }

    /// With a term whose coefficient is known.
    ///
    /// # Errors
    /// As for [`Structure::with`].
    pub fn known(mut self, equation: &str, function: &str, value: f64) -> Result<Self, InferenceError> {
        let place = self.place(equation, function, value)?;
        self.known[(place.equation, place.function)] += value;
        Ok(self)
    }

    /// Without the coefficients of these names: their terms are left out.
    #[must_use]
    pub fn without(mut self, names: &[&str]) -> Self {
        self.coefficients.retain(|c| !names.contains(&c.name.as_str()));
        self
    }

    /// With the coefficients at these indices alone.
    pub(crate) fn only(&self, coefficients: &[usize]) -> Self {
        let coefficients = coefficients.iter().map(|c| self.coefficients[*c].clone()).collect();
        Self { coefficients, ..self.clone() }
    }

    fn place(&self, equation: &str, function: &str, factor: f64) -> Result<Place, InferenceError> {
        let at = |what, names: &[String], name: &str| {
            let unknown = || InferenceError::Unknown { what, name: name.to_owned() };
            names.iter().position(|n| n == name).ok_or_else(unknown)
        };
        if !factor.is_finite() {
            return Err(InferenceError::Overflow { what: "the factor of a term" });
        }
        let equation = at("equation", &self.equations, equation)?;
        let function = at("function", &self.functions, function)?;
        Ok(Place { equation, function, factor })
    }

    /// Number of unknown coefficients P.
    pub fn n_coefficient(&self) -> usize {
        self.coefficients.len()
    }

    /// The unknown coefficients, length P.
    pub fn coefficients(&self) -> &[Coefficient] {
        &self.coefficients
    }

    /// Names of the equations, length L.
    pub fn equations(&self) -> &[String] {
        &self.equations
    }

    /// Number of functions B.
    pub fn n_function(&self) -> usize {
        self.functions.len()
    }

    /// C of L x B for the coefficients at these indices.
    pub(crate) fn matrix(&self, active: &[usize], values: &[f64]) -> DMatrix<f64> {
        let mut c = self.known.clone();
        for (p, value) in active.iter().zip(values) {
            for place in &self.coefficients[*p].places {
                c[(place.equation, place.function)] += place.factor * value;
            }
        }
        c
    }

    /// Whether these coefficients are the same functions in every equation, equation after equation, with a factor of one.
    pub(crate) fn is_shared(&self, active: &[usize]) -> bool {
        let per_equation = active.len() / self.equations.len().max(1);
        if per_equation == 0 || per_equation * self.equations.len() != active.len() {
            return false;
        }
        let place = |i: usize| match self.coefficients[active[i]].places.as_slice() {
            [place] if place.factor.to_bits() == 1.0_f64.to_bits() => Some((place.equation, place.function)),
            _ => None,
        };
        let expected = |i: usize| place(i % per_equation).map(|(_, function)| (i / per_equation, function));
        (0..active.len()).all(|i| place(i).is_some() && place(i) == expected(i))
    }

    /// Whether sums are of as many functions and equations.
    pub(crate) fn fits(&self, n_state: usize, n_function: usize) -> Result<(), InferenceError> {
        let shape = |what, expected, got| {
            if expected == got { Ok(()) } else { Err(InferenceError::Shape { what, expected, got }) }
        };
        shape("equations", n_state, self.equations.len())?;
        shape("functions", n_function, self.functions.len())
    }
}

//! The functions of an inference: families one after the other, each with the point of a step at which it is taken.
//!
//! The mid-point x* = (x_n + x_{n+1})/2 needs the slopes (Smelyanskiy, Luchinsky et al., "Physics-based methods of failure
//! analysis and diagnostics in human space flight", eq. 1.11, with F at x* as v is); the left point x_n needs none
//! (Itô) and serves functions whose slope has no bound, as the square root of a level at the opening. One regression may mix
//! both: each column then has a noise-free normal equation of its own, to first order in the step.
//! Read next: `stream.rs`, which takes sums of products of them.

use super::InferenceError;
use super::functions::{Columns, Functions, Samples};

/// Where in a step a function is taken.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// At the mid-point, with its slopes: errors of second order in the step for weak noise.
    MidPoint,
    /// At the start of the step, without slopes (Itô): errors of first order in the step.
    LeftPoint,
}

/// One family and its place.
struct Part {
    rule: Rule,
    functions: Box<dyn Functions>,
    first: usize,
    n: usize,
}

/// B functions of a sample of n_channel values, of which the first L are states.
pub struct Basis {
    n_state: usize,
    n_channel: usize,
    parts: Vec<Part>,
    names: Vec<String>,
}

impl std::fmt::Debug for Basis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Basis").field("names", &self.names).finish_non_exhaustive()
    }
}

impl Basis {
    /// A basis without functions for `n_state` states and `n_input` known inputs after them.
    pub fn new(n_state: usize, n_input: usize) -> Self {
        Self { n_state, n_channel: n_state + n_input, parts: Vec::new(), names: Vec::new() }
    }

    /// With the functions of one more family.
    ///
    /// # Errors
    /// `RepeatedName`.
    pub fn with(mut self, rule: Rule, functions: impl Functions + 'static) -> Result<Self, InferenceError> {
        let names = functions.names();
        let (first, n) = (self.names.len(), names.len());
        for name in names {
            if self.names.contains(&name) {
                return Err(InferenceError::RepeatedName { name });
            }
            self.names.push(name);
        }
        self.parts.push(Part { rule, functions: Box::new(functions), first, n });
        Ok(self)
    }

    /// Number of functions B.
    pub fn n_function(&self) -> usize {
        self.names.len()
    }

    /// Number of states L.
    pub fn n_state(&self) -> usize {
        self.n_state
    }

    /// Number of channels of a sample, states and inputs.
    pub fn n_channel(&self) -> usize {
        self.n_channel
    }

    /// Names of the functions, length B.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of the function of this name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Values of all functions at one sample, length B.
    pub fn values(&self, time: f64, x: &[f64], values: &mut [f64]) {
        for part in &self.parts {
            part.functions.values(time, x, &mut values[part.first..part.first + part.n]);
        }
    }

    /// Slopes ∂φ_b/∂x_l at one sample, `slopes[b * L + l]`, of functions of either rule.
    pub fn slopes(&self, time: f64, x: &[f64], slopes: &mut [f64]) {
        for part in &self.parts {
            let places = part.first * self.n_state..(part.first + part.n) * self.n_state;
            part.functions.slopes(time, x, &mut slopes[places]);
        }
    }

    /// Values of all functions for one step, each by its rule, from the times and the samples at its start and its mid-point.
    pub(crate) fn step_values(
        &self,
        [left, mid]: [f64; 2],
        [start, centre]: [&[f64]; 2],
        values: &mut [f64],
    ) {
        for part in &self.parts {
            let (time, x) = match part.rule {
                Rule::LeftPoint => (left, start),
                Rule::MidPoint => (mid, centre),
            };
            part.functions.values(time, x, &mut values[part.first..part.first + part.n]);
        }
    }

    /// Slopes of all functions for one step, `slopes[b * L + l]`, from the time and the sample at its mid-point; zero for those taken at
    /// the left point, which what moves in the step does not reach.
    pub(crate) fn step_slopes(&self, time: f64, mid: &[f64], slopes: &mut [f64]) {
        for part in &self.parts {
            let slopes = &mut slopes[part.first * self.n_state..(part.first + part.n) * self.n_state];
            match part.rule {
                Rule::LeftPoint => slopes.fill(0.0),
                Rule::MidPoint => part.functions.slopes(time, mid, slopes),
            }
        }
    }

    /// Columns of all functions for a block of steps, and their slopes added to `sums`.
    pub(crate) fn evaluate(
        &self,
        mid: &Samples<'_>,
        left: &Samples<'_>,
        columns: &mut [f64],
        height: usize,
        sums: &mut [f64],
    ) {
        for part in &self.parts {
            let places = part.first * height..(part.first + part.n) * height;
            let mut columns = Columns { values: &mut columns[places], height, n: mid.n };
            match part.rule {
                Rule::LeftPoint => part.functions.fill(left, &mut columns),
                Rule::MidPoint => {
                    part.functions.fill(mid, &mut columns);
                    let places = part.first * self.n_state..(part.first + part.n) * self.n_state;
                    part.functions.add_slopes(mid, &columns, &mut sums[places]);
                }
            }
        }
    }

    /// A number that tells bases apart by names, rules and channels (FNV-1a, Fowler, Noll and Vo).
    pub fn fingerprint(&self) -> u64 {
        let rules = self.parts.iter().flat_map(|p| std::iter::repeat_n(p.rule, p.n));
        let of_functions = self.names.iter().zip(rules).flat_map(|(name, rule)| {
            let rule = u8::from(rule == Rule::MidPoint);
            name.bytes().chain([0, rule])
        });
        let sizes = [self.n_state as u64, self.n_channel as u64];
        let sizes = sizes.into_iter().flat_map(u64::to_le_bytes);
        sizes
            .chain(of_functions)
            .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }
}

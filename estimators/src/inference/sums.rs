//! The sufficient statistics of a recording: plain sums over its steps, of constant size, which blocks add up to exactly.
//!
//! With a_n = (φ_n, ẋ_n), ẋ_n = (x_{n+1} − x_n)/h, they are Σ a aᵀ (which holds Φ = Σ φφᵀ, Z = Σ ẋφᵀ and Q = Σ ẋẋᵀ), the slopes
//! V_lb = Σ ∂φ_b/∂x_l, and Σ a_n a_{n+1}ᵀ, from which residuals at lag one follow. They do not depend on which functions enter
//! which equation: that is asked of them later (`structure.rs`), of one pass through the data. (Smelyanskiy, Luchinsky et al.,
//! eqs. 1.11 and 1.25.) Deliberately no basis inside: a fingerprint stands for it.
//! Read next: `stream.rs`, which makes them, and `fit.rs`, which reads them.

mod values;

use nalgebra::DMatrix;

use super::{Basis, InferenceError, STEP_TOLERANCE};

/// By how much of a step two steps may miss each other in time and still be neighbours.
const NEIGHBOUR: f64 = 2.0 * STEP_TOLERANCE;

/// Steps beyond which a count is no exact number.
pub(crate) const MOST: u64 = 1 << 53;

/// Sums over the steps of a recording, or of a block of it.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Sums {
    basis: u64,
    step: f64,
    n_function: usize,
    n_state: usize,
    n_step: u64,
    n_pair: u64,
    /// Upper triangle of Σ a aᵀ, (B+L) x (B+L).
    #[serde(with = "super::text::matrix")]
    products: DMatrix<f64>,
    /// Σ a_n a_{n+1}ᵀ, (B+L) x (B+L).
    #[serde(with = "super::text::matrix")]
    lagged: DMatrix<f64>,
    /// V, L x B.
    #[serde(with = "super::text::matrix")]
    slopes: DMatrix<f64>,
    first: Option<End>,
    last: Option<End>,
}

/// The first or last step of a block.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
struct End {
    /// When the step starts.
    time: f64,
    /// a, length B + L.
    row: Vec<f64>,
}

/// A block of steps to be added.
pub(crate) struct BlockSums<'a> {
    pub(crate) n: u64,
    pub(crate) products: &'a DMatrix<f64>,
    pub(crate) lagged: &'a DMatrix<f64>,
    /// Σ ∂φ_b/∂x_l, function after function.
    pub(crate) slopes: &'a [f64],
    pub(crate) times: [f64; 2],
    pub(crate) rows: [&'a [f64]; 2],
    /// Whether its first step follows the last one that was added.
    pub(crate) follows: bool,
}

impl Sums {
    /// Sums over no step, for steps of length `step`.
    pub fn new(basis: &Basis, step: f64) -> Self {
        let (b, l) = (basis.n_function(), basis.n_state());
        Self {
            basis: basis.fingerprint(),
            step,
            n_function: b,
            n_state: l,
            n_step: 0,
            n_pair: 0,
            products: DMatrix::zeros(b + l, b + l),
            lagged: DMatrix::zeros(b + l, b + l),
            slopes: DMatrix::zeros(l, b),
            first: None,
            last: None,
        }
    }

    /// Number of steps N.
    pub fn n_step(&self) -> u64 {
        self.n_step
    }

    /// Number of pairs of neighbouring steps.
    pub fn n_pair(&self) -> u64 {
        self.n_pair
    }

    /// Sampling step h.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Number of functions B.
    pub fn n_function(&self) -> usize {
        self.n_function
    }

    /// Number of states L.
    pub fn n_state(&self) -> usize {
        self.n_state
    }

    /// Φ = Σ φφᵀ, B x B.
    pub fn phi(&self) -> DMatrix<f64> {
        symmetric(&self.products, 0, self.n_function)
    }

    /// Z = Σ ẋφᵀ, L x B.
    pub fn z(&self) -> DMatrix<f64> {
        self.products.view((0, self.n_function), (self.n_function, self.n_state)).transpose()
    }

    /// V = Σ ∂φ_b/∂x_l, L x B, zero for functions taken at the left point.
    pub fn v(&self) -> &DMatrix<f64> {
        &self.slopes
    }

    /// Q = Σ ẋẋᵀ, L x L.
    pub fn q(&self) -> DMatrix<f64> {
        symmetric(&self.products, self.n_function, self.n_state)
    }

    /// Σ r_n r_{n+1}ᵀ of the residuals r = ẋ − C φ over neighbouring steps, L x L, for C of L x B.
    pub(crate) fn lagged_residuals(&self, c: &DMatrix<f64>) -> DMatrix<f64> {
        let (b, l) = (self.n_function, self.n_state);
        let part = |i, j, m, n| self.lagged.view((i, j), (m, n));
        let first = part(b, b, l, l) - c * part(0, b, b, l);
        first - (part(b, 0, l, b) - c * part(0, 0, b, b)) * c.transpose()
    }

    /// Σ φ_n φ_{n+1}ᵀ, B x B.
    pub(crate) fn lagged_phi(&self) -> DMatrix<f64> {
        self.lagged.view((0, 0), (self.n_function, self.n_function)).into_owned()
    }

    /// Σ rrᵀ of the residuals, L x L.
    pub(crate) fn residuals(&self, c: &DMatrix<f64>) -> DMatrix<f64> {
        let cross = c * self.z().transpose();
        let squares = self.q() - &cross - cross.transpose() + c * self.phi() * c.transpose();
        (&squares + squares.transpose()) * 0.5
    }

    /// Adds the steps of another block. Where its first step follows the last one here in time, the pair of both is counted too,
    /// so that blocks merged in order are the whole recording. Recordings of their own are first [detached](Self::detach).
    ///
    /// # Errors
    /// `Incompatible` with other functions, channels or steps, `Damaged` when a part has a wrong shape.
    pub fn merge(&mut self, later: &Self) -> Result<(), InferenceError> {
        self.fits(later)?;
        if let (Some(last), Some(first)) = (&self.last, &later.first)
            && (last.time + self.step - first.time).abs() <= NEIGHBOUR * self.step
        {
            rank_one(&mut self.lagged, &last.row, &first.row);
            self.n_pair = self.n_pair.saturating_add(1);
        }
        self.n_step = self.n_step.saturating_add(later.n_step);
        self.n_pair = self.n_pair.saturating_add(later.n_pair);
        self.products += &later.products;
        self.lagged += &later.lagged;
        self.slopes += &later.slopes;
        if self.first.is_none() {
            self.first.clone_from(&later.first);
        }
        if later.last.is_some() {
            self.last.clone_from(&later.last);
        }
        Ok(())
    }

    /// The sums of blocks in their order, `None` of none.
    ///
    /// # Errors
    /// As for [`Sums::merge`].
    pub fn of<'a>(blocks: impl IntoIterator<Item = &'a Self>) -> Result<Option<Self>, InferenceError> {
        let mut blocks = blocks.into_iter();
        let Some(mut whole) = blocks.next().cloned() else { return Ok(None) };
        blocks.try_for_each(|block| whole.merge(block))?;
        Ok(Some(whole))
    }

    /// Forgets where these steps begin and end in time, so that nothing is joined to them.
    #[must_use]
    pub fn detach(mut self) -> Self {
        self.first = None;
        self.last = None;
        self
    }

    /// Times at which the first and the last step start; `None` of no steps or detached ones.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([self.first.as_ref()?.time, self.last.as_ref()?.time])
    }

    /// Whether these sums, which came from elsewhere, are whole and of this basis.
    ///
    /// # Errors
    /// `Incompatible` with the basis, `Damaged` otherwise.
    pub fn check(&self, basis: &Basis) -> Result<(), InferenceError> {
        Self::new(basis, self.step).fits(self)?;
        let damaged = |what| Err(InferenceError::Damaged { what });
        if !(self.step > 0.0 && self.step.is_finite()) {
            return damaged("a step that is not positive and finite");
        }
        let parts = [&self.products, &self.lagged, &self.slopes];
        if parts.iter().any(|part| part.iter().any(|v| !v.is_finite())) {
            return damaged("a sum that is not finite");
        }
        if self.n_step > MOST
            || self.n_pair > self.n_step
            || self.products.diagonal().iter().any(|v| *v < 0.0)
        {
            return damaged("counts or squares that cannot be");
        }
        let width = self.n_function + self.n_state;
        let ends = self.first.iter().chain(&self.last);
        if ends.into_iter().any(|end| {
            end.row.len() != width || !end.time.is_finite() || end.row.iter().any(|v| !v.is_finite())
        }) {
            return damaged("an end of another length or that is not finite");
        }
        Ok(())
    }

    /// Whether another block can be merged.
    pub(crate) fn fits(&self, other: &Self) -> Result<(), InferenceError> {
        let same =
            |equal: bool, what| if equal { Ok(()) } else { Err(InferenceError::Incompatible { what }) };
        same(self.basis == other.basis, "their functions")?;
        same((self.n_function, self.n_state) == (other.n_function, other.n_state), "their size")?;
        // The caller gives the step of a recording once; other digits are another recording.
        same((self.step - other.step).abs() <= 1e-9 * self.step, "their step")?;
        let width = self.n_function + self.n_state;
        let whole = |m: &DMatrix<f64>, shape| m.shape() == shape;
        let ends = [&self.last, &other.first, &other.last];
        if whole(&other.products, (width, width))
            && whole(&other.lagged, (width, width))
            && whole(&other.slopes, (self.n_state, self.n_function))
            && ends.into_iter().flatten().all(|end| end.row.len() == width)
        {
            return Ok(());
        }
        Err(InferenceError::Damaged { what: "a part of another shape" })
    }

    /// Without pairs of neighbouring steps and without ends.
    pub(crate) fn without_pairs(mut self) -> Self {
        self.n_pair = 0;
        self.lagged.fill(0.0);
        self.detach()
    }

    /// Adds a block of steps.
    pub(crate) fn add(&mut self, block: &BlockSums<'_>) {
        self.products += block.products;
        self.lagged += block.lagged;
        for (sum, v) in self.slopes.as_mut_slice().iter_mut().zip(block.slopes) {
            *sum += v;
        }
        if let (true, Some(last)) = (block.follows, &self.last) {
            rank_one(&mut self.lagged, &last.row, block.rows[0]);
            self.n_pair += 1;
        }
        self.n_step += block.n;
        self.n_pair += block.n - 1;
        if self.first.is_none() {
            self.first = Some(End { time: block.times[0], row: block.rows[0].to_vec() });
        }
        match &mut self.last {
            Some(last) => {
                last.time = block.times[1];
                last.row.copy_from_slice(block.rows[1]);
            }
            None => self.last = Some(End { time: block.times[1], row: block.rows[1].to_vec() }),
        }
    }
}

/// The block of a symmetric matrix that is held as its upper triangle.
fn symmetric(upper: &DMatrix<f64>, first: usize, n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| upper[(first + i.min(j), first + i.max(j))])
}

fn rank_one(products: &mut DMatrix<f64>, left: &[f64], right: &[f64]) {
    for (mut column, r) in products.column_iter_mut().zip(right) {
        column.iter_mut().zip(left).for_each(|(sum, l)| *sum += l * r);
    }
}

//! A short vector on the stack. Next file to read: [`super::extended`], its only user.

/// Room for a few numbers without allocating: rates are evaluated many times per step.
pub(super) struct Scratch {
    small: [f64; SMALL],
    large: Vec<f64>,
    n: usize,
}

/// Longest vector that is kept on the stack.
const SMALL: usize = 16;

impl Scratch {
    /// `n` zeros.
    pub(super) fn new(n: usize) -> Self {
        let large = if n > SMALL { vec![0.0; n] } else { Vec::new() };
        Self { small: [0.0; SMALL], large, n }
    }

    /// A copy of `values`.
    pub(super) fn of(values: &[f64]) -> Self {
        let mut scratch = Self::new(values.len());
        scratch.as_mut().copy_from_slice(values);
        scratch
    }

    pub(super) fn as_ref(&self) -> &[f64] {
        if self.n > SMALL { &self.large } else { &self.small[..self.n] }
    }

    pub(super) fn as_mut(&mut self) -> &mut [f64] {
        if self.n > SMALL { &mut self.large } else { &mut self.small[..self.n] }
    }
}

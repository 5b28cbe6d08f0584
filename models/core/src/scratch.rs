//! A short vector on the stack. Next files to read: `effect/extended.rs` and `integrate/dopri5.rs`, which use it.

/// Room for `N` numbers without allocating, and on the heap for more: rates are evaluated many times per step, and spans between
/// samples are often one step long.
pub(crate) struct ShortVec<const N: usize> {
    small: [f64; N],
    large: Vec<f64>,
    n: usize,
}

/// Room for the states, inputs, outputs or parameters of a small model.
pub(crate) type Scratch = ShortVec<16>;

impl<const N: usize> ShortVec<N> {
    /// `n` zeros.
    pub(crate) fn new(n: usize) -> Self {
        let large = if n > N { vec![0.0; n] } else { Vec::new() };
        Self { small: [0.0; N], large, n }
    }

    /// A copy of `values`.
    pub(crate) fn of(values: &[f64]) -> Self {
        let mut scratch = Self::new(values.len());
        scratch.as_mut().copy_from_slice(values);
        scratch
    }

    #[inline]
    pub(crate) fn as_ref(&self) -> &[f64] {
        if self.n > N { &self.large } else { &self.small[..self.n] }
    }

    #[inline]
    pub(crate) fn as_mut(&mut self) -> &mut [f64] {
        if self.n > N { &mut self.large } else { &mut self.small[..self.n] }
    }
}

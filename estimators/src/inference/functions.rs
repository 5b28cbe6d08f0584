//! What a family of basis functions is: values and slopes at samples, one by one and in blocks.
//!
//! Deliberately no coefficients here: which equation a function enters is the business of `structure.rs`.
//! Read next: `polynomial.rs` and `function.rs`, the families that there are, and `basis.rs`, which joins families.

/// Basis functions φ_b(x, t) of one kind.
///
/// The samples x hold n_channel values: the L states, whose equations are inferred, then known inputs.
pub trait Functions: Send + Sync {
    /// A name for each, as `x1*x2`.
    fn names(&self) -> Vec<String>;

    /// Values of all of them at one sample.
    fn values(&self, time: f64, x: &[f64], values: &mut [f64]);

    /// Slopes ∂φ_b/∂x_l by the L states at one sample, function after function: `slopes[b * L + l]`.
    fn slopes(&self, time: f64, x: &[f64], slopes: &mut [f64]);

    /// Values at many samples, a column per function.
    fn fill(&self, samples: &Samples<'_>, columns: &mut Columns<'_>) {
        let n_function = columns.values.len() / columns.height;
        let (mut x, mut values) = (vec![0.0; samples.n_channel()], vec![0.0; n_function]);
        for row in 0..samples.n {
            samples.read(row, &mut x);
            self.values(samples.times[row], &x, &mut values);
            for (b, value) in values.iter().enumerate() {
                columns.values[b * columns.height + row] = *value;
            }
        }
    }

    /// Adds the slopes at many samples to `sums`, ordered as by [`Functions::slopes`]; `columns` are the values there.
    fn add_slopes(&self, samples: &Samples<'_>, _columns: &Columns<'_>, sums: &mut [f64]) {
        let (mut x, mut slopes) = (vec![0.0; samples.n_channel()], vec![0.0; sums.len()]);
        for row in 0..samples.n {
            samples.read(row, &mut x);
            self.slopes(samples.times[row], &x, &mut slopes);
            sums.iter_mut().zip(&slopes).for_each(|(sum, slope)| *sum += slope);
        }
    }
}

/// A block of n samples, channel after channel.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    pub(crate) n: usize,
    pub(crate) times: &'a [f64],
    pub(crate) channels: &'a [f64],
    pub(crate) height: usize,
    pub(crate) n_state: usize,
}

impl<'a> Samples<'a> {
    /// Number of samples n.
    pub fn n_sample(&self) -> usize {
        self.n
    }

    /// Number of states L, the first channels.
    pub fn n_state(&self) -> usize {
        self.n_state
    }

    /// Number of channels, states and inputs.
    pub fn n_channel(&self) -> usize {
        self.channels.len() / self.height
    }

    /// Times, length n.
    pub fn times(&self) -> &'a [f64] {
        &self.times[..self.n]
    }

    /// Values of one channel, length n.
    pub fn channel(&self, channel: usize) -> &'a [f64] {
        &self.channels[channel * self.height..][..self.n]
    }

    /// One sample, length n_channel.
    pub(crate) fn read(&self, row: usize, x: &mut [f64]) {
        for (value, column) in x.iter_mut().zip(self.channels.chunks_exact(self.height)) {
            *value = column[row];
        }
    }
}

/// Values of functions at a block of samples, a column per function.
#[derive(Debug)]
pub struct Columns<'a> {
    pub(crate) values: &'a mut [f64],
    pub(crate) height: usize,
    pub(crate) n: usize,
}

impl Columns<'_> {
    /// Values of one function, length n.
    pub fn column(&self, function: usize) -> &[f64] {
        &self.values[function * self.height..][..self.n]
    }

    /// Values of one function, to be written.
    pub fn column_mut(&mut self, function: usize) -> &mut [f64] {
        &mut self.values[function * self.height..][..self.n]
    }

    /// Values of an earlier function, and of a later one to be written.
    pub(crate) fn pair(&mut self, earlier: usize, later: usize) -> (&[f64], &mut [f64]) {
        let (before, after) = self.values.split_at_mut(later * self.height);
        (&before[earlier * self.height..][..self.n], &mut after[..self.n])
    }
}

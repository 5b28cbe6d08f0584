//! Makes sums of a recording as its rows arrive, in constant memory.
//!
//! Rows are gathered in blocks of 256; a block's functions become columns, and its products are made in vector registers. Each
//! block keeps the last row for the next one, so the steps do not depend on where blocks are cut. Nothing is allocated per row.
//! Steps must be equal within [`STEP_TOLERANCE`]. Read next: `products.rs`, how they are summed, and `sums.rs`, what they are added to.

mod culprit;

use std::sync::Arc;

use nalgebra::DMatrix;
use pulp::Arch;

use super::functions::Samples;
use super::products::{LANES, Products};
use super::sums::{BlockSums, MOST};
use super::{Basis, InferenceError, Sums};

/// Steps of a block.
const ROWS: usize = 256;
/// Length of a column, with room for zeros.
const HEIGHT: usize = ROWS + LANES;
/// By how much of the sampling step a step may differ from it. Over many rows times may differ from equal steps by a tenth of that share,
/// beyond one step's own difference: the coefficients are too large by as much as the steps are too long.
pub const STEP_TOLERANCE: f64 = 0.01;
/// The share over many rows.
const DRIFT: f64 = 0.1 * STEP_TOLERANCE;

/// A recording on its way into [`Sums`].
#[derive(Debug)]
pub struct Stream {
    arch: Arch,
    basis: Arc<Basis>,
    /// Names of channels for messages are their numbers; rows are counted from the start.
    row: u64,
    n: usize,
    follows: bool,
    times: Vec<f64>,
    channels: Vec<f64>,
    mid_times: Vec<f64>,
    mid: Vec<f64>,
    columns: DMatrix<f64>,
    products: DMatrix<f64>,
    lagged: DMatrix<f64>,
    slopes: Vec<f64>,
    ends: [Vec<f64>; 2],
    sums: Sums,
}

/// A recording between two rows.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct StreamState {
    row: u64,
    /// Time and values of the last row, states and then inputs, with which the next step starts.
    pub last: Option<(f64, Vec<f64>)>,
    follows: bool,
    sums: Sums,
}

impl Stream {
    /// An empty recording with steps of length `step`.
    ///
    /// # Errors
    /// `NotPositive`.
    pub fn new(basis: Arc<Basis>, step: f64) -> Result<Self, InferenceError> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(InferenceError::NotPositive { what: "the sampling step", value: step });
        }
        let (b, l, width) = (basis.n_function(), basis.n_state(), basis.n_function() + basis.n_state());
        let channels = vec![0.0; basis.n_channel() * HEIGHT];
        Ok(Self {
            arch: Arch::new(),
            row: 0,
            n: 0,
            follows: false,
            times: vec![0.0; HEIGHT],
            mid: channels.clone(),
            channels,
            mid_times: vec![0.0; HEIGHT],
            columns: DMatrix::zeros(HEIGHT, width),
            products: DMatrix::zeros(width, width),
            lagged: DMatrix::zeros(width, width),
            slopes: vec![0.0; b * l],
            ends: [vec![0.0; width], vec![0.0; width]],
            sums: Sums::new(&basis, step),
            basis,
        })
    }

    /// Takes the next row: its time and n_channel values. A row that is refused leaves all as it was.
    ///
    /// # Errors
    /// `Shape`, `NonFinite`, `NotIncreasing`, `TimeJump` (then [`Stream::break_off`] and push again goes on), `NonUniform`.
    pub fn push(&mut self, time: f64, values: &[f64]) -> Result<(), InferenceError> {
        self.admit(time, values)?;
        self.times[self.n] = time;
        for (column, value) in self.channels.chunks_exact_mut(HEIGHT).zip(values) {
            column[self.n] = *value;
        }
        self.n += 1;
        self.row += 1;
        if self.n > ROWS { self.flush() } else { Ok(()) }
    }

    /// Takes many rows, row after row in `values`.
    ///
    /// # Errors
    /// As for [`Stream::push`].
    pub fn extend(&mut self, times: &[f64], values: &[f64]) -> Result<(), InferenceError> {
        let expected = times.len() * self.basis.n_channel();
        if values.len() != expected {
            return Err(InferenceError::Shape { what: "recorded values", expected, got: values.len() });
        }
        let mut rows = values.chunks_exact(self.basis.n_channel());
        times.iter().zip(&mut rows).try_for_each(|(time, row)| self.push(*time, row))
    }

    /// Ends this piece of the recording: no step is made to the next row.
    ///
    /// # Errors
    /// As for [`Stream::sums`].
    pub fn break_off(&mut self) -> Result<(), InferenceError> {
        self.flush()?;
        self.n = 0;
        self.follows = false;
        Ok(())
    }

    /// The sums so far.
    ///
    /// # Errors
    /// `NonFinite` when a function has no finite value at a row; the rows since the last block are then lost.
    pub fn sums(&mut self) -> Result<&Sums, InferenceError> {
        self.flush()?;
        Ok(&self.sums)
    }

    /// The sums since the last call, a block of the recording; the next block begins with the last row of this one.
    ///
    /// # Errors
    /// As for [`Stream::sums`].
    pub fn take(&mut self) -> Result<Sums, InferenceError> {
        self.flush()?;
        let empty = Sums::new(&self.basis, self.sums.step());
        Ok(std::mem::replace(&mut self.sums, empty))
    }

    /// What the recording goes on from, in this program or another.
    ///
    /// # Errors
    /// As for [`Stream::sums`].
    pub fn state(&mut self) -> Result<StreamState, InferenceError> {
        self.flush()?;
        let row = || self.channels.chunks_exact(HEIGHT).map(|column| column[0]).collect();
        let last = (self.n > 0).then(|| (self.times[0], row()));
        Ok(StreamState { row: self.row, last, follows: self.follows, sums: self.sums.clone() })
    }

    /// Goes on from a state.
    ///
    /// # Errors
    /// As for [`Sums::check`] and [`Stream::new`]; `Damaged` for a last row that does not fit.
    pub fn resume(basis: Arc<Basis>, state: StreamState) -> Result<Self, InferenceError> {
        state.sums.check(&basis)?;
        if state.row > MOST {
            return Err(InferenceError::Damaged { what: "the number of a row" });
        }
        let mut stream = Self::new(basis, state.sums.step())?;
        if let Some((time, values)) = &state.last {
            let fits = stream.admit(*time, values).is_ok();
            if !fits {
                return Err(InferenceError::Damaged { what: "the last row of a recording" });
            }
            stream.push(*time, values)?;
        }
        (stream.row, stream.follows, stream.sums) = (state.row, state.follows, state.sums);
        Ok(stream)
    }

    /// Rows taken.
    pub fn n_row(&self) -> u64 {
        self.row
    }

    /// The basis.
    pub fn basis(&self) -> &Arc<Basis> {
        &self.basis
    }

    fn admit(&self, time: f64, values: &[f64]) -> Result<(), InferenceError> {
        let (row, step, expected) = (self.row, self.sums.step(), self.basis.n_channel());
        if values.len() != expected {
            return Err(InferenceError::Shape { what: "values of a row", expected, got: values.len() });
        }
        let named = std::iter::once(&time).chain(values).position(|v| !v.is_finite());
        if let Some(k) = named {
            let (what, value) =
                if k == 0 { ("time".into(), time) } else { (format!("channel {}", k - 1), values[k - 1]) };
            return Err(InferenceError::NonFinite { row, what, value });
        }
        if self.n == 0 {
            return Ok(());
        }
        let before = self.times[self.n - 1];
        let got = time - before;
        if got <= 0.0 {
            return Err(InferenceError::NotIncreasing { row, before, time });
        }
        if got > 1.5 * step {
            return Err(InferenceError::TimeJump { row, before, time, step });
        }
        let drift = (time - self.times[0] - self.n as f64 * step).abs();
        if (got - step).abs() > STEP_TOLERANCE * step
            || drift > (DRIFT * self.n as f64 + STEP_TOLERANCE) * step
        {
            return Err(InferenceError::NonUniform { row, got, step });
        }
        Ok(())
    }

    /// Adds the gathered steps to the sums and keeps the last row.
    fn flush(&mut self) -> Result<(), InferenceError> {
        let n = self.n.saturating_sub(1);
        if n == 0 {
            return Ok(());
        }
        self.evaluate(n);
        let done = self.add(n);
        self.times[0] = self.times[n];
        self.channels.chunks_exact_mut(HEIGHT).for_each(|column| column[0] = column[n]);
        self.n = 1;
        self.follows = done.is_ok();
        done
    }

    /// Columns of the functions and of ẋ for n steps.
    fn evaluate(&mut self, n: usize) {
        let (b, l, step) = (self.basis.n_function(), self.basis.n_state(), self.sums.step());
        for (mid, x) in self.mid.chunks_exact_mut(HEIGHT).zip(self.channels.chunks_exact(HEIGHT)) {
            for (mid, pair) in mid.iter_mut().zip(x[..=n].windows(2)) {
                *mid = 0.5 * (pair[0] + pair[1]);
            }
        }
        for (mid, pair) in self.mid_times.iter_mut().zip(self.times[..=n].windows(2)) {
            *mid = 0.5 * (pair[0] + pair[1]);
        }
        let values = self.columns.as_mut_slice();
        let samples = |times, channels| Samples { n, times, channels, height: HEIGHT, n_state: l };
        let (mid, left) = (samples(&self.mid_times, &self.mid), samples(&self.times, &self.channels));
        self.slopes.fill(0.0);
        self.basis.evaluate(&mid, &left, &mut values[..b * HEIGHT], HEIGHT, &mut self.slopes);
        let states = self.channels.chunks_exact(HEIGHT).take(l);
        let speeds = values[b * HEIGHT..].chunks_exact_mut(HEIGHT);
        for (speed, x) in speeds.zip(states) {
            for (speed, pair) in speed.iter_mut().zip(x[..=n].windows(2)) {
                *speed = (pair[1] - pair[0]) / step;
            }
        }
        values.chunks_exact_mut(HEIGHT).for_each(|column| column[n..].fill(0.0));
    }

    /// Adds the products of n rows of the columns.
    fn add(&mut self, n: usize) -> Result<(), InferenceError> {
        self.products.fill(0.0);
        self.lagged.fill(0.0);
        for (lag, sums) in [&mut self.products, &mut self.lagged].into_iter().enumerate() {
            let columns = self.columns.as_slice();
            self.arch.dispatch(Products { columns, height: HEIGHT, rows: n, lag, sums });
        }
        if !self.products.iter().chain(&self.slopes).all(|v| v.is_finite()) {
            return Err(self.culprit(n));
        }
        for (end, row) in self.ends.iter_mut().zip([0, n - 1]) {
            end.iter_mut().zip(self.columns.row(row).iter()).for_each(|(to, from)| *to = *from);
        }
        self.sums.add(&BlockSums {
            n: n as u64,
            products: &self.products,
            lagged: &self.lagged,
            slopes: &self.slopes,
            times: [self.times[0], self.times[n - 1]],
            rows: [&self.ends[0], &self.ends[1]],
            follows: self.follows,
        });
        Ok(())
    }
}

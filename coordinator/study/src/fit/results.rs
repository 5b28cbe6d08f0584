//! What goes to a fleet and what comes back, by particle and window.
//!
//! Next file to read: [`super::runner`].

use std::sync::Arc;

use starlings_fleet::Held;
use starlings_models::{Failure, Prediction, Window};

/// The windows of one step, one per record that still has data: (record, window).
pub(crate) type StepWindows = Vec<(usize, Arc<Window>)>;

/// A prediction per particle and window, or why there is none: a failure of the model, or the limit of wall time.
pub(crate) type Results = Vec<Vec<Predicted>>;

/// A prediction, or why there is none.
pub(crate) type Predicted = Result<Prediction<Held>, Failure>;

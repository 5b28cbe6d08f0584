//! The screening: which effects are tried, and what each would add to a finished fit, to first order.
//!
//! Files: [`candidates`] and [`resolve`] (which effects, in which units), [`not_tried`] (which physics none of them covers),
//! [`residual_timing`] (periods and instants worth trying), [`along_run`] (terms without a run), [`natural_amplitude`] (how large a probe must be), [`influence`] and
//! [`screening_result`] (what is measured), [`probe`] and [`response`] (how), [`screening`] (all of it in one batch), [`proposals`] (terms
//! that nobody listed).

mod along_run;
pub(crate) mod candidates;
pub(crate) mod influence;
mod natural_amplitude;
pub(crate) mod not_tried;
mod probe;
pub(crate) mod proposals;
pub(crate) mod residual_timing;
pub(crate) mod resolve;
mod response;
pub(crate) mod screening;
pub(crate) mod screening_result;
mod springs;

//! Model variants and their least-squares fits.
//!
//! Files, each of which sees only those before it: [`kind`] (where an effect comes from), [`same_form`] (one effect under two
//! names), [`candidate`] (an effect to try), [`model_variant`] (the study with effects
//! added or terms left out), [`jacobian`], [`fitted_variant`] (a variant with its fit), [`differences`] (Jacobians from runs),
//! [`drive`] (several fits at a time), [`own_values`] and [`prediction_sd`] (what is uncertain of a prediction).

pub(crate) mod candidate;
pub(crate) mod differences;
pub(crate) mod drive;
pub(crate) mod fitted_variant;
pub(crate) mod jacobian;
pub(crate) mod kind;
pub(crate) mod model_variant;
pub(crate) mod own_values;
pub(crate) mod prediction_sd;
pub(crate) mod same_form;

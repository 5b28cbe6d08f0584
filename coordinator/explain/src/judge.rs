//! Judging fits: what chance alone would give, which gates a refitted variant passes, and the verdict on all of them.
//!
//! Files, each of which sees only those before it: [`effective_noise`], [`null_distribution`] (what a search finds by chance),
//! [`misfit`], [`adequacy`] (residuals against the stated noise), [`uncertainty`] (what the uncertainty of an estimate explains),
//! [`held_out`], [`form`] (whether an effect has the right form), [`gates`], [`search_result`] (all that was judged),
//! [`noise_model`] (whether the noise is correlated), [`contribution`] (whether every effect takes away its share), [`objections`]
//! (what speaks against a name), [`verdict`].

pub(crate) mod adequacy;
pub(crate) mod contribution;
pub(crate) mod effective_noise;
pub(crate) mod form;
pub(crate) mod gates;
pub(crate) mod held_out;
pub(crate) mod misfit;
pub(crate) mod noise_model;
pub(crate) mod null_distribution;
mod objections;
mod range;
pub(crate) mod search_result;
mod uncertainty;
pub(crate) mod verdict;

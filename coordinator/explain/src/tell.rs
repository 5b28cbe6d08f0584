//! What an explanation tells: its result, sentences, figures, warnings, and the study with the effects in it.
//!
//! Files: [`result`] (`explain.json`), [`figures`] (what the report draws), [`summary`] (the numbers of both), [`correlated`]
//! (the noise), [`words`], `tie`, [`warnings`], [`stand`] and [`rejected`] (the sentences), [`experiment`] (what would separate tied effects), [`patch`] (the study with
//! the effects in it), [`findings`] (all of it, and its place in the run's database).

pub(crate) mod correlated;
mod errors;
pub(crate) mod experiment;
pub(crate) mod figures;
pub(crate) mod findings;
pub(crate) mod patch;
pub(crate) mod rejected;
pub mod result;
pub(crate) mod stand;
pub(crate) mod summary;
mod tie;
pub(crate) mod warnings;
pub(crate) mod words;

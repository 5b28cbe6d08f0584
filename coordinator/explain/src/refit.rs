//! The search: refits of the best candidates, then a second pass from the best of them with replacements and pairs.
//!
//! Files: [`search`], [`further`] (kinds that are tried last), [`race`], [`near_priors`] (a second start), [`instants`], [`ranking`],
//! [`replacements`] of terms, [`pairs`], their [`members`] and [`finite`] where no effect explains the gap alone, [`simpler`] terms in a
//! pair, [`second_pass`], [`twins`] of what is told, and [`modulated_forms`], whose effects ask whether the form of an effect is right.

mod finite;
pub(crate) mod further;
mod instants;
mod members;
mod modulated_forms;
mod near_priors;
pub(crate) mod other_forms;
mod pairs;
mod race;
mod ranking;
mod replacements;
pub(crate) mod search;
mod second_pass;
mod simpler;
pub(crate) mod twins;

//! The search: refits of the best candidates, then a second pass from the best of them with replacements and pairs.
//!
//! Files: [`search`], [`race`], [`second_pass`], and [`modulated_forms`], whose effects ask whether the form of an effect is right.

mod modulated_forms;
mod race;
pub(crate) mod search;
mod second_pass;

//! The study: what is asked, the loop that answers it, and the store that keeps every step.
//!
//! The data path: a study file becomes a checked [`Study`]; [`run`] sends its windows to a fleet and its predictions to an
//! estimator; every step goes to the [`store`], from which the summary and the report are made.


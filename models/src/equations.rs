//! Models written in a study as equations (to be filled).

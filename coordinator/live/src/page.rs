//! The page: three texts that are part of the program.

/// The page.
pub(crate) const HTML: &str = include_str!("page/page.html");
/// How it looks.
pub(crate) const CSS: &str = include_str!("page/page.css");
/// What it does.
pub(crate) const SCRIPT: &str = include_str!("page/page.js");

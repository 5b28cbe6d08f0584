//! What every page has in common: its head, its style, its frame, and the parts that several pages show.
//!
//! `layout/frame.html` is the document, `layout/parts.html` holds figures, facts and warnings; a page's own template fills the
//! frame's blocks and only arranges. Next file to read: `page.rs`.

use serde::Serialize;

use super::ReportError;

/// Puts a page together: `template` fills the frame with what `view` holds.
///
/// # Errors
///
/// The template asks for what the view does not hold.
pub(super) fn document(template: &'static str, view: impl Serialize) -> Result<String, ReportError> {
    let mut environment = minijinja::Environment::new();
    environment.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    environment.add_global("css", include_str!("report.css"));
    environment.add_template("frame.html", include_str!("layout/frame.html"))?;
    environment.add_template("parts.html", include_str!("layout/parts.html"))?;
    environment.add_template("page.html", template)?;
    Ok(environment.get_template("page.html")?.render(minijinja::value::Serde(view))?)
}

//! What every page has in common: its head, its style, its script, its frame with a table of contents, and the parts that several
//! pages show.
//!
//! `layout/frame.html` is the document, `layout/parts.html` holds figures, facts and warnings; a page's own template fills the
//! frame's blocks and only arranges. `layout/figure.js` serves the figures of every page; without it a page still reads and
//! prints. Next file to read: `page.rs`.

mod tables;

use serde::Serialize;

use super::ReportError;

/// Where the frame has the table of contents.
const CONTENTS: &str = "<!--contents-->";

/// Puts a page together: `template` fills the frame with what `view` holds.
///
/// # Errors
///
/// The template asks for what the view does not hold.
pub(super) fn document(template: &'static str, view: impl Serialize) -> Result<String, ReportError> {
    let mut environment = minijinja::Environment::new();
    environment.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    environment.add_global("css", include_str!("report.css"));
    environment.add_global("script", include_str!("layout/figure.js"));
    environment.add_template("frame.html", include_str!("layout/frame.html"))?;
    environment.add_template("parts.html", include_str!("layout/parts.html"))?;
    environment.add_template("page.html", template)?;
    let page = environment.get_template("page.html")?.render(minijinja::value::Serde(view))?;
    let contents = contents(&page);
    Ok(tables::labelled(&page.replacen(CONTENTS, &contents, 1)))
}

/// A link to every section of a page that has a heading. No text of a study opens a section: it is escaped.
fn contents(page: &str) -> String {
    let sections = page.split("<section id=\"").skip(1).filter_map(|rest| {
        let (id, rest) = rest.split_once('"')?;
        let own = rest.split("</section>").next()?;
        let heading = own.split_once("<h2>")?.1.split("</h2>").next()?;
        Some(format!("<li><a href=\"#{id}\">{heading}</a></li>"))
    });
    format!("<ol><li><a href=\"#result\">Result</a></li>{}</ol>", sections.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_with_a_heading_is_in_the_table_of_contents() {
        let page = "<section id=\"fit\">\n<h2>The fit</h2></section><section id=\"none\"></section>\
                    <section id=\"fleet\"><details><summary><h2>Fleet</h2></summary></details></section>";
        let expected = "<ol><li><a href=\"#result\">Result</a></li><li><a href=\"#fit\">The fit</a></li>\
                        <li><a href=\"#fleet\">Fleet</a></li></ol>";
        assert_eq!(contents(page), expected);
    }
}

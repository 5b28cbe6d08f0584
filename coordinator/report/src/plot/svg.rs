//! Text of an SVG element: escaped text and coordinates.
//!
//! Our own because a drawing here has no size: it stretches with its page, while strokes, dots and text keep theirs
//! (`vector-effect`), which no drawing library at hand writes.

/// Text that cannot become markup.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The head of an element that assistive technology can read, up to its content.
pub(crate) fn head(attributes: &str, title: &str, description: &str) -> String {
    let title = escape(title);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" {attributes} role=\"img\" aria-label=\"{title}\"><title>{title}</title>\
         <desc>{}</desc>",
        escape(description)
    )
}

/// A filled rectangle.
pub(crate) fn rect((x, y): (f64, f64), (width, height): (f64, f64), class: &str, opacity: f64) -> String {
    let [x, y, width, height] = [x, y, width, height].map(short);
    let opacity = if opacity < 1.0 { format!(" fill-opacity=\"{}\"", short(opacity)) } else { String::new() };
    format!("<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"{opacity}/>")
}

/// A coordinate without needless digits.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

//! Colours, safe for colour-blind readers, each with one meaning on every page.
//!
//! Okabe & Ito, "Color universal design" (2008), some darker for contrast. A page takes them by name from `report.css`, which has
//! them for dark screens too; the values here are for pictures that stand alone, and a test holds both equal.

/// A colour by its name in the style sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Colour {
    /// Its name.
    pub(crate) name: &'static str,
    /// Its value on light paper, `#RRGGBB`.
    pub(crate) hex: &'static str,
}

const fn colour(name: &'static str, hex: &'static str) -> Colour {
    Colour { name, hex }
}

/// Text and measured values.
pub(crate) const INK: Colour = colour("ink", "#1f2933");
/// Axes, tick labels, reference lines and secondary text.
pub(crate) const MUTED: Colour = colour("muted", "#55606a");
/// The training span.
pub(crate) const SHADE: Colour = colour("shade", "#edf1f4");
/// Prior, earlier passes, others.
pub(crate) const GREY: Colour = colour("grey", "#8a959e");
/// Prediction and posterior; of an explanation, after.
pub(crate) const BLUE: Colour = colour("blue", "#0067a3");
/// Of an explanation, before: the model as it is.
pub(crate) const VERMILION: Colour = colour("vermilion", "#b84a00");
/// Held out: what no fit saw.
pub(crate) const PURPLE: Colour = colour("purple", "#96348a");
/// Bands of what noise or chance leaves.
pub(crate) const GREEN: Colour = colour("green", "#007a59");
/// Observed above predicted; positive.
pub(crate) const ABOVE: Colour = colour("above", "#e69f00");
/// Observed below predicted; negative.
pub(crate) const BELOW: Colour = colour("below", "#56b4e9");
/// A limit that somebody set: a level, a horizon, a threshold.
pub(crate) const LIMIT: Colour = colour("limit", "#7a5c00");

/// Equals, told apart by the figure's legend alone: records, observers.
pub(crate) const EQUALS: [Colour; 7] = [
    colour("equal-1", "#0067a3"),
    colour("equal-2", "#b84a00"),
    colour("equal-3", "#007a59"),
    colour("equal-4", "#96348a"),
    colour("equal-5", "#7a5c00"),
    colour("equal-6", "#2f86b5"),
    colour("equal-7", "#1f2933"),
];

/// Every colour of a page.
pub(crate) const ALL: [Colour; 11] =
    [INK, MUTED, SHADE, GREY, BLUE, VERMILION, PURPLE, GREEN, ABOVE, BELOW, LIMIT];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_style_sheet_has_every_colour_under_its_name() {
        let sheet = include_str!("../report.css");
        let light = sheet.lines().find(|line| line.starts_with(":root")).unwrap();
        for colour in ALL {
            let defined = format!("--{}: {};", colour.name, colour.hex);
            assert!(light.contains(&defined), "{defined}");
        }
        // Equals borrow the colours of others, and are told apart by the legend of their figure.
        for colour in EQUALS {
            let class = format!(".c.{}, .key.{} {{ --c: var(--", colour.name, colour.name);
            let source = sheet.lines().find_map(|line| line.strip_prefix(&class)).unwrap();
            let variable = source.split(')').next().unwrap();
            assert!(light.contains(&format!("--{variable}: {};", colour.hex)), "{}", colour.name);
        }
    }
}

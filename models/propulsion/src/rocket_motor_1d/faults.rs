//! Faults along the bore: a hole in the case, a bore that narrows at a place, a crack that adds burning surface.
//!
//! A fault of the throat is a course of its area ([`crate::throat`]). Next file to read: [`super::layout`].

use serde::Deserialize;
use starlings_models_core::Quantity;

/// A fault that a layout may have; each brings parameters of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Fault {
    /// Gas leaves through a hole whose area grows.
    Breach,
    /// The propellant bulges into the bore and narrows it.
    Choking,
    /// The propellant cracks and burns on more surface.
    Cracking,
}

/// Largest share of the bore that choking takes.
const MOST: f64 = 0.95;

impl Fault {
    /// Parameters of the fault.
    pub(super) fn parameters(self) -> Vec<Quantity> {
        let any = |name: &str, unit: &str, default: f64, says: &str| {
            Quantity::new(name, unit).range(0.0, f64::INFINITY).default(default).says(says)
        };
        let positive = |name: &str, unit: &str, default: f64, says: &str| {
            Quantity::new(name, unit).positive().default(default).says(says)
        };
        match self {
            Self::Breach => vec![
                any("t_breach", "s", 1e3, "Time of the breach of the case."),
                any("x_breach", "m", 0.5, "Distance of the hole from the head end."),
                any("breach_area", "m^2", 1e-4, "Area of the hole when it opens."),
                any("breach_growth", "m^2/s", 0.0, "Growth of the hole."),
            ],
            Self::Choking => vec![
                any("t_choke", "s", 1e3, "Time at which the bore begins to narrow."),
                any("x_choke", "m", 0.5, "Distance of the narrowest place from the head end."),
                any("choke", "", 0.3, "Share of the bore's area that is taken there in the end.")
                    .range(0.0, MOST),
                positive(
                    "w_choke",
                    "m",
                    0.1,
                    "Distance over which the narrowing falls to 1/e; give it eight cells or more.",
                ),
                positive("tau_choke", "s", 0.05, "Time in which the bore narrows."),
            ],
            Self::Cracking => vec![
                any("t_crack", "s", 1e3, "Time of the crack."),
                any("x_crack", "m", 0.5, "Distance of the crack from the head end."),
                any("crack_area", "m^2", 0.02, "Burning surface that the crack adds when it opens."),
                any("crack_growth", "m^2/s", 0.0, "Growth of that surface."),
            ],
        }
    }
}

/// The faults of a layout at one time.
#[derive(Clone, Debug, Default)]
pub(super) struct Active {
    /// A hole: place and area.
    pub(super) breach: Option<(f64, f64)>,
    /// A crack: place and burning surface.
    pub(super) crack: Option<(f64, f64)>,
    choke: Option<[f64; 3]>,
}

impl Active {
    /// The faults that have begun; `theta` holds their parameters in the order of the layout.
    pub(super) fn at(faults: &[Fault], t: f64, theta: &[f64]) -> Self {
        let (mut active, mut rest) = (Self::default(), theta);
        for fault in faults {
            let since = t - rest[0];
            let begun = since >= 0.0;
            let grown = |own: &[f64]| (own[1], own[2] + own[3] * since);
            match fault {
                Fault::Breach => {
                    active.breach = begun.then(|| grown(rest));
                    rest = &rest[4..];
                }
                Fault::Choking => {
                    let share = rest[2].min(MOST) * (since / rest[4]).clamp(0.0, 1.0);
                    active.choke = begun.then_some([rest[1], share, rest[3]]);
                    rest = &rest[5..];
                }
                Fault::Cracking => {
                    active.crack = begun.then(|| grown(rest));
                    rest = &rest[4..];
                }
            }
        }
        active
    }

    /// The share of the bore's area that is open at a place.
    pub(super) fn open(&self, x: f64) -> f64 {
        self.choke.map_or(1.0, |[place, share, width]| 1.0 - share * (-((x - place) / width).powi(2)).exp())
    }
}

/// The two cells between whose centres a place lies, with their shares; `dx` is the length of one of `n` cells.
pub(super) fn shares(x: f64, dx: f64, n: usize) -> [(usize, f64); 2] {
    let at = (x / dx - 0.5).clamp(0.0, (n - 1) as f64);
    let first = (at.floor() as usize).min(n - 2);
    let share = at - first as f64;
    [(first, 1.0 - share), (first + 1, share)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_begin_at_their_time_and_read_their_own_parameters() {
        let faults = [Fault::Choking, Fault::Breach, Fault::Cracking];
        let theta = [1.0, 0.4, 0.5, 0.1, 2.0, 2.0, 0.6, 1e-4, 1e-3, 9.0, 0.1, 0.2, 0.3];
        let active = Active::at(&faults, 2.0, &theta);
        assert!((active.open(0.4) - 0.75).abs() < 1e-15, "half of the ramp");
        assert!((active.open(0.5) - (1.0 - 0.25 * (-1.0_f64).exp())).abs() < 1e-15);
        assert!(active.breach == Some((0.6, 1e-4)) && active.crack.is_none());
        let later = Active::at(&faults, 10.0, &theta);
        let (place, area) = later.crack.unwrap();
        assert!((place - 0.1).abs() < 1e-15 && (area - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_place_is_shared_by_the_cells_around_it() {
        for x in [0.0, 0.03, 0.1, 0.37, 0.5, 0.98, 1.0] {
            let [(i, a), (j, b)] = shares(x, 0.1, 10);
            let centre = |i: usize| 0.1 * (i as f64 + 0.5);
            assert!((a + b - 1.0).abs() < 1e-15 && a >= 0.0 && b >= 0.0 && j == i + 1 && j < 10);
            assert!((a * centre(i) + b * centre(j) - x.clamp(0.05, 0.95)).abs() < 1e-14, "{x}");
        }
    }
}

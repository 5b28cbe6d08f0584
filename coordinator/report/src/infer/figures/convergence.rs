//! How the estimate of each coefficient converges as the recording goes on.

use starlings_estimators::quantiles::normal;
use starlings_infer::Inference;
use starlings_infer::result::{CoefficientFound, LEVEL};

use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, MUTED};
use crate::plot::scene::Scene;

/// Figures at most: those of coefficients that differ from zero come first.
const FIGURES: usize = 12;

/// One figure per coefficient: estimate and 90 % interval after each power of two of blocks.
pub(super) fn figures(found: &Inference) -> Vec<Figure> {
    let mut order: Vec<(usize, &CoefficientFound)> = found.coefficients.iter().enumerate().collect();
    order.sort_by_key(|(p, c)| (c.may_be_zero != Some(false), *p));
    let figures = order.into_iter().filter_map(|(p, c)| figure(found, p, c));
    figures.take(FIGURES).collect()
}

/// The figure of one coefficient; none where it has fewer than two estimates.
fn figure(found: &Inference, p: usize, c: &CoefficientFound) -> Option<Figure> {
    let at = found.convergence.iter().filter_map(|at| Some((at.time, at.values.get(p).copied().flatten()?)));
    let points: Vec<(f64, [f64; 2])> = at.collect();
    let (last, sd) = match points.as_slice() {
        [_, .., (_, [mean, sd])] => (*mean, *sd),
        _ => return None,
    };
    let half = normal(0.5 + 0.5 * LEVEL);
    let ends = points.iter().flat_map(|(_, [mean, sd])| [mean - half * sd, mean + half * sd]);
    let x = Axis::log_around(&with_unit("recorded time", &found.time_unit), points.iter().map(|p| p.0));
    let y = Axis::around(&c.name, ends);
    let marks = vec![
        Mark::Band {
            points: points.iter().map(|(t, [mean, sd])| (*t, mean - half * sd, mean + half * sd)).collect(),
            colour: BLUE,
            opacity: 0.2,
        },
        Mark::dashed_level((x.lo, x.hi), last, MUTED),
        Mark::Line {
            points: points.iter().map(|(t, [mean, _])| (*t, *mean)).collect(),
            colour: BLUE,
            width: 1.75,
        },
        Mark::Dots {
            points: points.iter().map(|(t, [mean, _])| (*t, *mean)).collect(),
            colour: BLUE,
            radius: 2.5,
        },
    ];
    let of = found.convergence_of.as_ref().map_or_else(String::new, |of| format!(" These are {of}."));
    let caption = format!("{} ± {} at the end.{of}", number::with_sd(last, sd), number::significant(sd, 2));
    let scene = Scene { title: c.name.clone(), description: caption.clone(), x, y, marks };
    let keys = [("line blue", "estimate"), ("area blue", "90 % interval"), ("dash muted", "at the end")];
    Some(Figure::new(&scene, &keys, caption))
}

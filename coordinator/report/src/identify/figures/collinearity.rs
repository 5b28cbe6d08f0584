//! Collinearity of growing subsets of the parameters.

use starlings_study::identify::Identification;

use crate::plot::axis::Axis;
use crate::plot::figure::Figure;
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, LIMIT};
use crate::plot::scene::Scene;

/// Collinearity index that Brun, Reichert & Künsch (2001) call critical.
const CRITICAL: f64 = 10.0;

/// One figure: the index of the best conditioned subset of every size; none without subsets.
pub(super) fn figures(found: &Identification) -> Vec<Figure> {
    let points: Vec<(f64, f64)> = found
        .collinearity
        .growing
        .iter()
        .filter_map(|subset| Some((subset.parameters.len() as f64, subset.index?)))
        .collect();
    if points.is_empty() {
        return Vec::new();
    }
    let x = Axis::over_run("parameters in the subset", points.iter().map(|p| p.0));
    let y = Axis::log_around("collinearity index", points.iter().map(|p| p.1).chain([1.0, CRITICAL]));
    let marks = vec![
        Mark::dashed_level((x.lo, x.hi), CRITICAL, LIMIT),
        Mark::Line { points: points.clone(), colour: BLUE, width: 1.75 },
        Mark::Dots { points: points.clone(), colour: BLUE, radius: 3.0 },
    ];
    let below = points.iter().filter(|p| p.1 < CRITICAL).map(|p| p.0).fold(1.0, f64::max);
    let caption = format!(
        "Up to {below:.0} of these parameters can be estimated together with an index below {CRITICAL}: from there on, a \
         change of one is hidden by changes of the others to within a tenth."
    );
    let title = "Collinearity of growing subsets".to_owned();
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [("dot blue", "best conditioned subset"), ("dash limit", "critical")];
    vec![Figure::new(&scene, &keys, caption)]
}

//! Residuals over operating regions: bars over the bins of one signal, a map over the bins of two.
//!
//! The same map before and after the effects is drawn on the same scale, so that both can be compared. Next file to read:
//! `force.rs`.

use starlings_explain::Figures;
use starlings_explain::locate::RegionMap;
use starlings_explain::result::Explanation;

use crate::number::{self, quantity};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{ABOVE, BELOW, GREEN, GREY, INK, MUTED};
use crate::plot::scene::Scene;

/// Maps drawn at most.
const MAPS: usize = 10;

/// One bin with values.
#[derive(Debug, Clone, Copy)]
struct Bin {
    x: (f64, f64),
    y: Option<(f64, f64)>,
    bias: f64,
    rmse: f64,
    count: usize,
}

impl Bin {
    /// Standard deviation of the residuals about their mean.
    fn scatter(&self) -> f64 {
        (self.rmse * self.rmse - self.bias * self.bias).max(0.0).sqrt()
    }
}

/// The maps that account for most of the residuals, each beside itself with the effects.
pub(super) fn figures(_: &Explanation, data: &Figures) -> Vec<Figure> {
    let mut order: Vec<&RegionMap> = data.before.maps.iter().collect();
    order.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    let mut figures = Vec::new();
    for before in order.into_iter().take(MAPS) {
        let same = |m: &&RegionMap| m.channel == before.channel && m.x == before.x && m.y == before.y;
        let after = data.maps_after.iter().find(same);
        let alike: Vec<&RegionMap> = [Some(before), after].into_iter().flatten().collect();
        let word = if after.is_some() { "before" } else { "the model as it is" };
        figures.extend(figure(before, word, &alike));
        if let Some(after) = after {
            figures.extend(figure(after, "after", &alike));
        }
    }
    figures
}

/// Draws `map`, on the scale of all of `alike`; `None` when it has no bin with values.
fn figure(map: &RegionMap, when: &str, alike: &[&RegionMap]) -> Option<Figure> {
    let bins = bins(map);
    if bins.is_empty() {
        return None;
    }
    let all: Vec<Bin> = alike.iter().flat_map(|other| self::bins(other)).collect();
    let title = match &map.y {
        None => format!("{} over {}: {when}", map.channel, map.x.0),
        Some((y, _)) => format!("{} over {} and {y}: {when}", map.channel, map.x.0),
    };
    let x = Axis::tight(&with_unit(&map.x.0, &map.x.1), map.x_edges.iter().copied());
    let worst = worst(map, &bins);
    let drawn = match &map.y {
        None => one_signal(map, &bins, &all, (title, x, worst)),
        Some((name, unit)) => {
            let y = Axis::tight(&with_unit(name, unit), map.y_edges.iter().copied());
            two_signals(map, &bins, &all, (title, x, y, worst))
        }
    };
    Some(drawn)
}

fn one_signal(
    map: &RegionMap,
    bins: &[Bin],
    all: &[Bin],
    (title, x, worst): (String, Axis, String),
) -> Figure {
    let noise = if map.noise.is_finite() { map.noise.abs() } else { 0.0 };
    let reach = all.iter().flat_map(|b| [b.bias - b.scatter(), b.bias + b.scatter()]);
    let label = with_unit(&format!("{}, mean of observed − predicted", map.channel), &map.unit);
    let y = Axis::around(&label, reach.chain([-noise, noise]));
    let ends = (x.lo, x.hi);
    let mut marks = vec![Mark::flat_band(ends, (-noise, noise), GREEN, 0.16)];
    for bin in bins {
        let (from, to) = bin.x;
        let inset = 0.05 * (to - from);
        let colour = if bin.bias > 0.0 { ABOVE } else { BELOW };
        let sides = (bin.bias.min(0.0), bin.bias.max(0.0));
        marks.push(Mark::flat_band((from + inset, to - inset), sides, colour, 0.75));
        let middle = 0.5 * (from + to);
        let points = vec![(middle, bin.bias - bin.scatter()), (middle, bin.bias + bin.scatter())];
        marks.push(Mark::Line { points, colour: INK, width: 1.5 });
    }
    marks.push(Mark::level(ends, 0.0, MUTED));
    let caption = format!("{worst} Bars that stay within the band are no more than noise would leave.");
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("area solid above", "observed above predicted"),
        ("area solid below", "below"),
        ("tick ink", "± sd within the bin"),
        ("area green", "± noise sd"),
    ];
    Figure::new(&scene, &keys, caption)
}

fn two_signals(
    map: &RegionMap,
    bins: &[Bin],
    all: &[Bin],
    (title, x, y, worst): (String, Axis, Axis, String),
) -> Figure {
    // Colour begins at the noise, so that a map of noise alone stays pale.
    let scale = all.iter().map(|b| b.bias.abs()).fold(map.noise.abs().max(f64::MIN_POSITIVE), f64::max);
    let mut marks = Vec::new();
    for bin in bins {
        let Some(side) = bin.y else { continue };
        marks.push(Mark::flat_band(bin.x, side, GREY, 0.15));
        let colour = if bin.bias > 0.0 { ABOVE } else { BELOW };
        let share = (bin.bias.abs() / scale).min(1.0);
        if share > 0.02 {
            marks.push(Mark::flat_band(bin.x, side, colour, 0.9 * share));
        }
    }
    let caption = format!(
        "{worst} The fullest colour is ± {}; a patch of one colour is a region that the model describes wrongly.",
        quantity(scale, &map.unit)
    );
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [
        ("area solid above", "observed above predicted"),
        ("area solid below", "below"),
        ("area grey-pale", "visited"),
    ];
    Figure::map(&scene, &keys, caption)
}

/// The bin with the largest mean square, in words.
fn worst(map: &RegionMap, bins: &[Bin]) -> String {
    let Some(bin) = bins.iter().max_by(|a, b| a.rmse.total_cmp(&b.rmse)) else { return String::new() };
    let range = |(lo, hi): (f64, f64), (name, unit): &(String, String)| {
        format!("{name} from {} to {}", number::significant(lo, 3), quantity(hi, unit))
    };
    let mut place = range(bin.x, &map.x);
    if let (Some(side), Some(signal)) = (bin.y, &map.y) {
        place = format!("{place} and {}", range(side, signal));
    }
    let explained = if map.explained.is_finite() {
        let share = number::percent(map.explained.max(0.0));
        format!(" The bins account for {share} of the variance of the residuals.")
    } else {
        String::new()
    };
    format!(
        "Largest with {place}: {} rms, {} on average ({} values).{explained}",
        quantity(bin.rmse, &map.unit),
        quantity(bin.bias, &map.unit),
        bin.count
    )
}

/// The bins that hold values, with finite edges.
fn bins(map: &RegionMap) -> Vec<Bin> {
    let finite = |pair: &[f64]| pair[0].is_finite() && pair[1].is_finite() && pair[0] < pair[1];
    let n_x = map.x_edges.len().saturating_sub(1);
    let side = |p: &[f64]| if finite(p) { (p[0], p[1]) } else { (f64::NAN, f64::NAN) };
    let rows: Vec<Option<(f64, f64)>> =
        if map.y.is_some() { map.y_edges.windows(2).map(|p| Some(side(p))).collect() } else { vec![None] };
    let mut bins = Vec::new();
    for (j, y) in rows.into_iter().enumerate() {
        for (i, pair) in map.x_edges.windows(2).enumerate() {
            let k = j * n_x + i;
            let value = |list: &[Option<f64>]| list.get(k).copied().flatten().filter(|v| v.is_finite());
            let (Some(bias), Some(rmse)) = (value(&map.bias), value(&map.rmse)) else { continue };
            if finite(pair) && y.is_none_or(|side| side.0.is_finite()) {
                let count = map.count.get(k).copied().unwrap_or(0);
                bins.push(Bin { x: (pair[0], pair[1]), y, bias, rmse, count });
            }
        }
    }
    bins
}

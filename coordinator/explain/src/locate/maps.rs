//! Residuals over bins of one or two signals, and the same bins for the runs of another model.
//!
//! Next file to read: [`super::result`].

use super::residuals::{Residuals, groups, primary};
use super::result::ends;
use super::signal::{MOST_TRACKS, along};
use super::{RegionMap, Track, View};

/// Bins of one signal.
const BINS: usize = 12;
/// Bins per signal of two.
const BINS_2D: usize = 7;
/// Maps of one signal per channel, and signals whose pairs are tried.
const MOST: (usize, usize) = (6, 4);

/// Maps of every channel: of one signal each, the most telling first, then the best of two signals.
pub(super) fn maps(view: &View<'_>, groups: &[Residuals]) -> Vec<RegionMap> {
    primary(groups).into_iter().flat_map(|group| of_channel(view, group)).collect()
}

/// The same bins for the residuals of another model's runs. Values beyond the outer edges count in the outer bins, since
/// the signals of the other model may reach further; a signal that it does not have leaves the bins empty.
pub fn map_again(map: &RegionMap, view: &View<'_>) -> RegionMap {
    let groups = groups(view);
    let group = primary(&groups).into_iter().find(|g| g.channel == map.channel);
    let mut again = map.clone();
    let n = map.count.len();
    (again.count, again.bias, again.rmse, again.explained) = (vec![0; n], vec![None; n], vec![None; n], 0.0);
    let Some(group) = group else { return again };
    let of = |name: &str| view.tracks.iter().find(|t| t.name == name).map(|t| along(t, group));
    let Some(x) = of(&map.x.0) else { return again };
    let y = match &map.y {
        Some((name, _)) => match of(name) {
            Some(y) => Some(y),
            None => return again,
        },
        None => None,
    };
    fill(&mut again, group, &x, y.as_deref());
    again
}

fn of_channel(view: &View<'_>, group: &Residuals) -> Vec<RegionMap> {
    let mut one: Vec<(RegionMap, usize)> = Vec::new();
    let tracks = &view.tracks[..view.tracks.len().min(MOST_TRACKS)];
    for (index, track) in tracks.iter().enumerate() {
        let x = along(track, group);
        let of = |edges: Option<Vec<f64>>| Some(map(group, (track, &x, edges?), None));
        let maps = [of(even(&x, BINS)), of(quantiles(&x, BINS))];
        let better = maps.into_iter().flatten().max_by(|a, b| a.explained.total_cmp(&b.explained));
        one.extend(better.map(|map| (map, index)));
    }
    one.sort_by(|a, b| b.0.explained.total_cmp(&a.0.explained));
    let pairs = pair(tracks, group, &one);
    let mut maps: Vec<RegionMap> = one.into_iter().take(MOST.0).map(|(map, _)| map).collect();
    maps.extend(pairs);
    maps
}

/// The most telling map of two of the best signals.
fn pair(tracks: &[Track], group: &Residuals, one: &[(RegionMap, usize)]) -> Option<RegionMap> {
    let best: Vec<&Track> = one.iter().take(MOST.1).map(|(_, index)| &tracks[*index]).collect();
    let mut most: Option<RegionMap> = None;
    for (k, a) in best.iter().enumerate() {
        for b in &best[k + 1..] {
            let (x, y) = (along(a, group), along(b, group));
            let (Some(x_edges), Some(y_edges)) = (even(&x, BINS_2D), even(&y, BINS_2D)) else { continue };
            let map = map(group, (a, &x, x_edges), Some(&(b, &y, y_edges)));
            if most.as_ref().is_none_or(|m| map.explained > m.explained) {
                most = Some(map);
            }
        }
    }
    most
}

/// A signal with its values and edges.
type Axis<'a> = (&'a Track, &'a [f64], Vec<f64>);

fn map(group: &Residuals, x: Axis<'_>, y: Option<&Axis<'_>>) -> RegionMap {
    let label = |track: &Track| (track.name.clone(), track.unit.clone());
    let n = (x.2.len() - 1) * y.map_or(1, |y| y.2.len() - 1);
    let mut map = RegionMap {
        channel: group.channel.clone(),
        unit: group.unit.clone(),
        noise: group.noise,
        x: label(x.0),
        y: y.map(|y| label(y.0)),
        x_edges: x.2,
        y_edges: y.map_or(Vec::new(), |y| y.2.clone()),
        count: vec![0; n],
        bias: vec![None; n],
        rmse: vec![None; n],
        explained: 0.0,
    };
    fill(&mut map, group, x.1, y.map(|y| y.1));
    map
}

/// Counts, means and root mean squares over the map's edges.
fn fill(map: &mut RegionMap, group: &Residuals, x: &[f64], y: Option<&[f64]>) {
    let n_x = map.x_edges.len() - 1;
    let mut sums = vec![(0.0, 0.0); map.count.len()];
    for (i, e) in group.value.iter().enumerate() {
        let Some(column) = bin(&map.x_edges, x[i]) else { continue };
        let Some(row) = y.map_or(Some(0), |y| bin(&map.y_edges, y[i])) else { continue };
        let at = row * n_x + column;
        map.count[at] += 1;
        sums[at].0 += e;
        sums[at].1 += e * e;
    }
    for (at, (sum, squares)) in sums.iter().enumerate().filter(|(at, _)| map.count[*at] > 0) {
        let n = map.count[at] as f64;
        map.bias[at] = Some(sum / n);
        map.rmse[at] = Some((squares / n).sqrt());
    }
    map.explained = explained(&map.count, &sums);
}

/// 1 − within-bin over total variance, each with its degrees of freedom; not below zero.
fn explained(count: &[usize], sums: &[(f64, f64)]) -> f64 {
    let (mut n, mut bins, mut sum, mut squares, mut between) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (count, (s, ss)) in count.iter().zip(sums).filter(|(count, _)| **count > 0) {
        n += *count as f64;
        bins += 1.0;
        sum += s;
        squares += ss;
        between += s * s / *count as f64;
    }
    let (total, within) = (squares - sum * sum / n, squares - between);
    if n > bins && total > 0.0 { (1.0 - (within / (n - bins)) / (total / (n - 1.0))).max(0.0) } else { 0.0 }
}

fn bin(edges: &[f64], value: f64) -> Option<usize> {
    value.is_finite().then(|| edges.partition_point(|e| *e <= value).clamp(1, edges.len() - 1) - 1)
}

/// Edges at even distances, `None` when the signal does not vary.
fn even(values: &[f64], bins: usize) -> Option<Vec<f64>> {
    let [lo, hi] = ends(values.iter().copied());
    (hi > lo).then(|| (0..=bins).map(|k| lo + (hi - lo) * k as f64 / bins as f64).collect())
}

/// Edges with as many values between each two, fewer where values are equal.
fn quantiles(values: &[f64], bins: usize) -> Option<Vec<f64>> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let mut edges: Vec<f64> = (0..=bins).map(|k| sorted[k * last / bins]).collect();
    edges.dedup();
    (edges.len() > 2).then_some(edges)
}

//! Normalised innovation squared against its chi-square band (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).
//!
//! The band is that of each analysis: one that uses fewer observed values scatters more.

use crate::data::{NisSeries, ReportData};
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::Figure;
use crate::plot::mark::Mark;
use crate::plot::measured::{drawn_as_dots, measured};
use crate::plot::palette::{BLUE, GREEN, GREY, MUTED};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// Smallest value on the logarithmic axis: what is below stands on the axis.
const FLOOR: f64 = 1e-2;

/// One figure of all passes; none without a pass.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    data.nis.last().map(|last| figure(&data.nis, last, data.x_label())).into_iter().collect()
}

fn figure(passes: &[NisSeries], last: &NisSeries, x_label: &str) -> Figure {
    let x = Axis::over_run(x_label, passes.iter().flat_map(|p| p.time.iter().copied()));
    let floored = |v: &f64| if v.is_nan() { f64::NAN } else { v.max(FLOOR) };
    let values = passes.iter().flat_map(|p| &p.nis_per_observation).chain(&last.lo).chain(&last.hi);
    let y = Axis::log_around("NIS per observation (1 expected)", values.map(floored).chain([1.0]));
    let ends = (x.lo, x.hi);
    let mut marks = band(last, ends);
    marks.push(Mark::dashed_level(ends, 1.0, MUTED));
    for (k, pass) in passes.iter().enumerate() {
        let colour = if k + 1 == passes.len() { BLUE } else { GREY };
        let value: Vec<f64> = pass.nis_per_observation.iter().map(floored).collect();
        marks.extend(measured(&pass.time, &value, colour));
    }
    let caption = caption(last);
    let few = drawn_as_dots(&last.time);
    let mut keys = vec![(if few { "dot blue" } else { "line blue" }, "last pass")];
    if passes.len() > 1 {
        keys.push((if few { "dot grey" } else { "line grey" }, "earlier passes"));
    }
    keys.extend([("area green", "95\u{a0}% band"), ("dash muted", "expected: 1")]);
    let title = "Normalised innovation squared per observation".to_owned();
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &keys, caption)
}

fn band(series: &NisSeries, ends: (f64, f64)) -> Vec<Mark> {
    let steps = steps(series, ends);
    let (time, (lo, hi)): (Vec<f64>, (Vec<f64>, Vec<f64>)) =
        steps.into_iter().map(|(t, lo, hi)| (t, (lo, hi))).unzip();
    let parts = thin::parts(&time, &lo, &hi).into_iter();
    parts.map(|part| Mark::Band { points: thin::band(&part), colour: GREEN, opacity: 0.16 }).collect()
}

/// The band as (time, lower, upper): that of an analysis reaches half-way to its neighbours; equal neighbours are one step.
fn steps(series: &NisSeries, ends: (f64, f64)) -> Vec<(f64, f64, f64)> {
    let known = series.time.iter().zip(series.lo.iter().zip(&series.hi));
    let known: Vec<(f64, f64, f64)> =
        known.filter(|(t, _)| t.is_finite()).map(|(t, (lo, hi))| (*t, lo.max(FLOOR), *hi)).collect();
    let mut steps: Vec<(f64, f64, f64)> = Vec::new();
    for (k, &(time, lo, hi)) in known.iter().enumerate() {
        let left = if k == 0 { ends.0 } else { f64::midpoint(known[k - 1].0, time) };
        let right = known.get(k + 1).map_or(ends.1, |next| f64::midpoint(time, next.0));
        match steps.last_mut() {
            Some(step) if step.1.total_cmp(&lo).is_eq() && step.2.total_cmp(&hi).is_eq() => step.0 = right,
            _ => steps.extend([(left, lo, hi), (right, lo, hi)]),
        }
    }
    steps
}

fn caption(last: &NisSeries) -> String {
    let bands = last.lo.iter().zip(&last.hi);
    let known = last.nis_per_observation.iter().zip(bands).filter(|(v, _)| v.is_finite());
    let (inside, n) = known.fold((0_u32, 0_u32), |(inside, n), (v, (lo, hi))| {
        (inside + u32::from((lo..=hi).contains(&v)), n + 1)
    });
    let used = match (last.n_used.iter().min(), last.n_used.iter().max()) {
        (Some(1), Some(1)) => "1 observed value per analysis".to_owned(),
        (Some(least), Some(most)) if least == most => format!("{most} observed values per analysis"),
        (Some(least), Some(most)) => format!("{least} to {most} observed values per analysis"),
        _ => "no observed values".to_owned(),
    };
    format!(
        "{} of the last pass lies inside the 95\u{a0}% band of chi-square ({used}). Above the band the \
         model does not explain the data at this noise level, and the intervals are too narrow; below it the noise is \
         stated too large. Values below {FLOOR} stand at {FLOOR}.",
        number::percent(f64::from(inside) / f64::from(n))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A first window with one value, then two.
    fn joint() -> NisSeries {
        NisSeries {
            pass: 1,
            time: vec![0.0, 1.0, 2.0, 3.0],
            nis_per_observation: vec![4.5, 4.5, 0.5, 1.0],
            lo: vec![0.001, 0.025, 0.025, 0.025],
            hi: vec![5.02, 3.69, 3.69, 3.69],
            n_used: vec![1, 2, 2, 2],
        }
    }

    #[test]
    fn the_band_steps_where_the_number_of_values_changes() {
        let expected = [(-0.1, FLOOR, 5.02), (0.5, FLOOR, 5.02), (0.5, 0.025, 3.69), (3.1, 0.025, 3.69)];
        assert_eq!(steps(&joint(), (-0.1, 3.1)), expected);
    }

    #[test]
    fn each_value_is_counted_against_its_own_band() {
        // 4.5 lies inside the band of one value and outside that of two.
        let caption = caption(&joint());
        assert!(caption.starts_with("75\u{a0}% of the last pass"), "{caption}");
        assert!(caption.contains("(1 to 2 observed values per analysis)"), "{caption}");
    }
}

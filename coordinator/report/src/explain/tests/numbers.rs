//! Numbers that no figure can show, and series that do not go together.

use starlings_explain::result::Explanation;
use starlings_explain::{Figures, Verdict};

use super::{found, page_of};

/// Fills every series and number of the figures with `values` in turn.
fn of_values(values: &[f64]) -> (Explanation, Figures) {
    let (mut e, mut f) = found(Verdict::Named, 1, 60);
    let mut endless = values.iter().copied().cycle();
    let mut next = || endless.next().unwrap_or_default();
    for curve in &mut f.curves {
        for series in [&mut curve.time, &mut curve.observed, &mut curve.before, &mut curve.after] {
            for v in series.iter_mut() {
                *v = next();
            }
        }
        (curve.noise, curve.train) = (next(), Some([next(), next()]));
    }
    for map in f.before.maps.iter_mut().chain(&mut f.maps_after) {
        map.x_edges.iter_mut().chain(&mut map.y_edges).for_each(|v| *v = next());
        map.bias.iter_mut().chain(&mut map.rmse).for_each(|v| *v = Some(next()));
        (map.noise, map.explained) = (next(), next());
    }
    for s in &mut f.before.spectra {
        s.frequency.iter_mut().chain(&mut s.power_over_noise).chain([&mut s.peak]).for_each(|v| *v = next());
    }
    for u in &mut f.before.forces {
        let series = u.time.iter_mut().chain(&mut u.value).chain(&mut u.sd).chain(&mut u.at);
        let series = series.chain(&mut u.proposed);
        series.chain([&mut u.log_likelihood_gain]).for_each(|v| *v = next());
    }
    for c in &mut f.before.correlations {
        (c.coefficient, c.interval95) = (next(), [next(), next()]);
    }
    for c in &mut f.before.channels {
        (c.rmse, c.noise, c.bias, c.lag1, c.whiteness_p) = (next(), next(), next(), next(), next());
    }
    f.null_gains.iter_mut().chain(&mut f.decoy_gains).chain([&mut f.best_gain]).for_each(|v| *v = next());
    e.held_out.iter_mut().for_each(|h| (h.before, h.after, h.beyond) = (next(), next(), next()));
    e.gap.iter_mut().for_each(|g| (g.before, g.after, g.noise) = (next(), next(), next()));
    e.parameter_shifts.iter_mut().for_each(|p| (p.before, p.after, p.sd) = (next(), next(), next()));
    e.screened.iter_mut().for_each(|s| (s.share, s.gain, s.identifiable) = (next(), next(), next()));
    let a = &mut e.false_alarm;
    (a.rate, a.upper95, a.threshold, a.decoys) = (next(), next(), next(), next());
    (e.remaining.rmse_over_noise, e.remaining.whiteness_p, e.wall_s) = (next(), next(), next());
    for c in e.effects.iter_mut().flat_map(|effect| &mut effect.parameters) {
        (c.estimate, c.sd, c.interval95) = (next(), next(), [next(), next()]);
    }
    (e, f)
}

#[test]
fn no_number_makes_a_figure_fail_or_a_page_large() {
    let (inf, nan, tiny) = (f64::INFINITY, f64::NAN, f64::from_bits(1));
    let cases = [
        vec![nan],
        vec![nan, inf, -inf, 1.0],
        vec![1e-200, 1e200],
        vec![tiny, f64::MAX],
        vec![-f64::MAX, f64::MAX, 0.0],
        vec![5.0],
        vec![0.0],
        vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0],
    ];
    for values in cases {
        let page = page_of(&of_values(&values));
        // The page of ordinary numbers has about 150 000 bytes.
        assert!(page.len() < 500_000, "{values:?}: {} bytes", page.len());
    }
}

#[test]
fn series_of_one_value_or_of_unequal_lengths_are_drawn_as_far_as_they_go() {
    page_of(&found(Verdict::Named, 1, 1));
    let mut sample = found(Verdict::Named, 1, 60);
    sample.1.curves[0].after.truncate(20);
    sample.1.before.forces[0].sd.clear();
    sample.1.before.forces[0].at.truncate(3);
    sample.1.before.forces[0].proposed.truncate(4);
    sample.1.before.maps[1].bias.truncate(5);
    sample.1.before.maps[0].x_edges.clear();
    sample.1.before.spectra[0].power_over_noise.truncate(1);
    page_of(&sample);
}

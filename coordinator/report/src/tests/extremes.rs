//! Numbers that no study should give, and more of them than anybody reads: the page stays well formed and small.

use super::super::data::{
    ChannelPlot, Family, NisSeries, ObserverPlot, ObserverRow, ParameterRow, ReportData, Track,
};
use super::super::{overview_svg, render, sample};
use super::{assert_well_formed, show};

#[test]
fn values_that_are_not_finite_are_left_out() {
    let nan = f64::NAN;
    let data = ReportData {
        parameters: vec![ParameterRow {
            name: "R".into(),
            estimate: nan,
            sd: nan,
            lo: nan,
            hi: f64::INFINITY,
            ..ParameterRow::default()
        }],
        correlation: vec![vec![nan, nan]],
        tracks: vec![Track { name: "R".into(), prior_median: nan, log_axis: true, ..Track::default() }],
        channels: vec![ChannelPlot {
            time: vec![0.0, 1.0],
            observed: vec![None, None],
            predicted: vec![nan, f64::INFINITY],
            noise: nan,
            held_out_channel: true,
            ..ChannelPlot::default()
        }],
        nis: vec![NisSeries { time: vec![0.0], nis_per_observation: vec![nan], ..NisSeries::default() }],
        nis_per_observation: Some(nan),
        ..ReportData::default()
    };
    assert_well_formed(&render(&data).unwrap());
    assert!(!overview_svg(&data).contains("NaN"));
}

/// Every number of every figure is one of `values` in turn.
fn of_values(values: &[f64]) -> ReportData {
    let mut data = sample::run(60);
    let mut next = values.iter().copied().cycle();
    let mut fill =
        |series: &mut Vec<f64>| series.iter_mut().for_each(|v| *v = next.next().unwrap_or_default());
    for channel in &mut data.channels {
        fill(&mut channel.predicted);
        channel.observed = channel.predicted.iter().rev().map(|v| Some(*v)).collect();
        channel.noise = values[0];
    }
    let components =
        (0..5).map(|i| ChannelPlot { channel: format!("wall[{i}]"), ..data.channels[0].clone() });
    data.channels = components.chain(data.channels.clone()).collect();
    let mut course = ObserverPlot { time: data.channels[0].time.clone(), ..ObserverPlot::default() };
    course.with.clone_from(&course.time);
    course.without.clone_from(&course.time);
    [&mut course.with, &mut course.without].into_iter().for_each(&mut fill);
    data.observer = Some(ObserverRow { with: values[0], courses: vec![course], ..ObserverRow::default() });
    data.families = vec![Family { stem: "E".into(), members: vec![(1, 0), (2, 1), (3, 2)], stiffness: true }];
    for pass in data.tracks.iter_mut().flat_map(|t| &mut t.passes) {
        [&mut pass.estimate, &mut pass.lo, &mut pass.hi].into_iter().for_each(&mut fill);
    }
    for series in &mut data.nis {
        [&mut series.nis_per_observation, &mut series.lo, &mut series.hi].into_iter().for_each(&mut fill);
    }
    for series in &mut data.autocorrelation {
        [&mut series.value, &mut series.lag_time].into_iter().for_each(&mut fill);
    }
    let value = |k: usize| values[k % values.len()];
    for (k, row) in data.parameters.iter_mut().enumerate() {
        (row.estimate, row.sd, row.lo, row.hi) = (value(k), value(k + 1), value(k), value(k + 1));
        (row.prior_lo, row.prior_median, row.prior_hi) = (value(k + 1), value(k), value(k + 2));
    }
    if let Some(times) = &mut data.fleet.time_per_run {
        let bins = times.bins.iter_mut().enumerate();
        bins.for_each(|(k, bin)| (bin.from, bin.to) = (value(k), value(k + 1)));
    }
    data
}

#[test]
fn the_most_extreme_numbers_make_a_page_of_the_usual_size() {
    let (inf, nan, tiny) = (f64::INFINITY, f64::NAN, f64::from_bits(1));
    let cases = [
        vec![1e-200, 1e200],
        vec![tiny, f64::MAX],
        vec![-f64::MAX, f64::MAX, 0.0],
        vec![nan, inf, -inf, 1.0],
        vec![tiny, f64::MIN_POSITIVE],
        vec![5.0],
        vec![0.0],
    ];
    for values in cases {
        let data = of_values(&values);
        let page = render(&data).unwrap();
        assert_well_formed(&page);
        // Numbers of figures are 8 bytes each, whatever they are.
        assert!(page.len() < 900_000, "{values:?}: {} bytes", page.len());
        assert!(overview_svg(&data).len() < 200_000);
    }
}

#[test]
fn a_hundred_thousand_samples_stay_a_small_file() {
    let page = render(&sample::run(100_000)).unwrap();
    show("long.html", &page);
    assert_well_formed(&page);
    // Drawn are 700 buckets of each of about 20 curves and bands; kept for the zoom are 280 000 buckets in all, of two numbers of 4
    // bytes, which base64 makes a third longer.
    assert!(page.len() < 280_000 * 8 * 4 / 3 + 800_000, "{} bytes", page.len());
}

#[test]
fn a_million_samples_stay_below_five_megabytes() {
    let page = render(&sample::run(1_000_000)).unwrap();
    show("million.html", &page);
    assert_well_formed(&page);
    assert!(page.len() <= 5_000_000, "{} bytes", page.len());
}

//! Windows over a recording, and changes in it.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Detector, Diffusion, Fit, Following, Function, Memory, Report, Rule, Stream, Structure, Sums,
    Window,
};

use crate::kit::{lorenz, median, motor, quantile, sums, tanks};

fn close(a: &Sums, b: &Sums) -> bool {
    (a.n_step(), a.n_pair()) == (b.n_step(), b.n_pair())
        && (a.phi() - b.phi()).amax() <= 1e-12 * a.phi().amax()
        && (a.q() - b.q()).amax() <= 1e-12 * a.q().amax()
}

#[test]
fn a_sliding_window_is_one_pass_over_its_rows_and_a_growing_one_over_all() {
    let (basis, h) = (lorenz::basis(), 0.005);
    let rows = lorenz::strong(6, 1000, h, 10.0);
    let mut stream = Stream::new(Arc::clone(&basis), h).unwrap();
    let (mut sliding, mut growing) = (Window::new(Memory::Sliding(4)), Window::new(Memory::Growing));
    for (n, row) in rows.iter().enumerate() {
        stream.push(n as f64 * h, row).unwrap();
        if n > 0 && n % 50 == 0 {
            let block = stream.take().unwrap();
            growing.push(block.clone()).unwrap();
            let forgotten = sliding.push(block).unwrap();
            assert_eq!(forgotten.is_some(), n > 200);
            let from = n.saturating_sub(200);
            assert!(close(&sliding.sums().unwrap(), &sums(&basis, &rows[from..=n], h)), "{n}");
        }
    }
    let whole = sums(&basis, &rows, h);
    assert!(close(&growing.sums().unwrap(), &whole));
    let (fit, structure) = (Fit::new(Diffusion::Full, 7), lorenz::seven(&basis));
    let earlier = fit.posterior(&sliding.sums().unwrap(), &structure).unwrap();
    let (fresh, updated) = (fit.posterior(&whole, &structure), fit.update(&whole, &structure, &earlier));
    let (fresh, updated) = (fresh.unwrap(), updated.unwrap());
    // D settles to 1e-11 of itself.
    assert!((fresh.mean() - updated.mean()).amax() < 1e-7 && updated.passes <= fresh.passes);
    assert_eq!((growing.n_block(), sliding.n_block(), sliding.is_full()), (1, 4, true));
}

/// Every report on a recording.
fn follow<const N: usize>(mut detector: Detector, h: f64, rows: &[[f64; N]]) -> (Detector, Vec<Report>) {
    let report = |(n, row): (usize, &[f64; N])| detector.push(n as f64 * h, row).unwrap();
    let reports = rows.iter().enumerate().filter_map(report).collect();
    (detector, reports)
}

fn throat(rate: f64) -> Detector {
    let basis = motor::basis();
    let structure = motor::throat(&basis);
    let following = Following {
        block: 1,
        recent: 4,
        reference: Memory::Growing,
        least: 200,
        longer: false,
        rate,
        watched: vec![],
    };
    Detector::new(basis, 0.001, structure, Fit::new(Diffusion::Full, 1), following).unwrap()
}

/// The throat loses a fifth at half a second.
#[test]
fn a_step_of_the_throat_is_detected_within_eight_milliseconds() {
    let fault = 0.5;
    let mut delays = Vec::new();
    for seed in 0..100 {
        let area = |t: f64| if t < fault - 1e-9 { 1.0 } else { 0.8 };
        let rows = motor::recording(900 + seed, 600, motor::equilibrium(), area);
        let (_, reports) = follow(throat(1e-9), 0.001, &rows);
        let alarm = reports.iter().find(|r| r.alarm).unwrap();
        assert!(alarm.time > fault, "a false alarm at {}", alarm.time);
        delays.push(alarm.time - fault);
    }
    println!("median {:.4} s, worst {:.4} s", median(delays.clone()), quantile(delays.clone(), 1.0));
    assert!(quantile(delays, 1.0) < 0.0085);
}

/// One test in fifty may be a false alarm.
#[test]
fn false_alarms_are_as_rare_as_stated() {
    let mut tests = 0;
    let mut alarms = 0;
    for seed in 0..60 {
        let rows = motor::recording(400 + seed, 700, 1.0, |_| 1.0);
        let (_, reports) = follow(throat(0.02), 0.001, &rows);
        tests += reports.len();
        alarms += reports.iter().filter(|r| r.alarm).count();
    }
    let rate = alarms as f64 / tests as f64;
    println!("{alarms} of {tests}: {rate:.4}");
    // Windows overlap by three of four steps, so 29 000 tests are worth about 10 000: an sd of 0.0014.
    assert!((0.014..0.026).contains(&rate), "{rate}");
}

/// Level rates alone, without knowing where the openings are: the inflow of tanks 2 and 3 begins.
#[test]
fn the_opening_of_a_tank_is_detected_within_a_tenth_of_a_second() {
    let one = |_: f64, _: &[f64]| 1.0;
    let basis = Basis::new(2, 0).with(Rule::MidPoint, Function::of_inputs("1", one)).unwrap();
    let basis = Arc::new(basis);
    let mut delays = [vec![], vec![]];
    for seed in 0..100 {
        let rows = tanks::recording(5000 + seed);
        let levels: Vec<[f64; 2]> = rows.iter().map(|x| [x[1], x[2]]).collect();
        let opening = |level| rows.iter().position(|x| x[0] > level).unwrap() as f64 * 0.002;
        for (k, opens) in [opening(tanks::H12), opening(tanks::H13)].into_iter().enumerate() {
            let structure = Structure::same(&basis, &["h2", "h3"]).unwrap();
            let following = Following {
                block: 25,
                recent: 1,
                reference: Memory::Growing,
                least: 250,
                longer: false,
                rate: 1e-6,
                watched: vec![k],
            };
            let fit = Fit::new(Diffusion::Diagonal, 2);
            let detector = Detector::new(Arc::clone(&basis), 0.002, structure, fit, following).unwrap();
            let (_, reports) = follow(detector, 0.002, &levels[..2000]);
            let alarm = reports.iter().find(|r| r.alarm).unwrap();
            assert!(alarm.time > opens, "a false alarm at {}, {opens}", alarm.time);
            delays[k].push(alarm.time - opens);
        }
    }
    for delays in delays {
        println!("median {:.3} s, q90 {:.3} s", median(delays.clone()), quantile(delays.clone(), 0.9));
        assert!(quantile(delays, 0.9) < 0.15);
    }
}

/// A column of which the reference knew nothing.
#[test]
fn a_term_that_appears_is_reported() {
    let basis = tanks::basis();
    let structure = tanks::joint(&basis);
    let following = Following {
        block: 25,
        recent: 4,
        reference: Memory::Sliding(20),
        least: 250,
        longer: false,
        rate: 1e-6,
        watched: vec![],
    };
    let fit = Fit::new(Diffusion::Diagonal, 9);
    let detector = Detector::new(Arc::clone(&basis), 0.002, structure, fit, following).unwrap();
    let rows = tanks::recording(3);
    let opens = rows.iter().position(|x| x[0] > tanks::H12).unwrap() as f64 * 0.002;
    let (detector, reports) = follow(detector, 0.002, &rows[..1300]);
    let first = reports.iter().find(|r| r.change.appeared.contains(&3)).unwrap();
    assert!((0.0..0.06).contains(&(first.time - opens)), "{} {opens}", first.time);
    let value = detector.posterior().unwrap().value("c12").unwrap();
    assert!((value.mean - 2.0).abs() < 4.0 * value.sd, "{value:?}");
}

#[test]
fn an_accepted_change_is_the_new_reference() {
    let area = |t: f64| if t < 0.3 { 1.0 } else { 0.8 };
    let rows = motor::recording(77, 900, motor::equilibrium(), area);
    let mut detector = throat(1e-9);
    let mut alarms = vec![];
    for (n, row) in rows.iter().enumerate() {
        let report = detector.push(n as f64 * 0.001, row).unwrap();
        if let Some(report) = report.filter(|r| r.alarm) {
            alarms.push(n);
            detector.accept(&report).unwrap();
        }
    }
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    let value = detector.posterior().unwrap().value("a").unwrap();
    assert!(
        (value.mean - 0.8 * motor::THROAT).abs() < 4.0 * value.sd + 10.0,
        "{value:?}: one old step is in it"
    );
}

/// A program that stops after a report and starts again from what it wrote says the same, to the last bit.
#[test]
fn a_detector_goes_on_from_its_state() {
    let rows = motor::recording(5, 500, 1.0, |t| if t < 0.4 { 1.0 } else { 0.9 });
    let detector = || throat(1e-6);
    let (_, whole) = follow(detector(), 0.001, &rows);
    let mut reports = vec![];
    let mut running = detector();
    for (n, row) in rows.iter().enumerate() {
        reports.extend(running.push(n as f64 * 0.001, row).unwrap());
        if n % 97 == 0 {
            let text = serde_json::to_string(&running.state().unwrap()).unwrap();
            running = detector().resume(serde_json::from_str(&text).unwrap()).unwrap();
        }
    }
    assert_eq!(reports, whole);
    let mut elsewhere = running.state().unwrap();
    elsewhere =
        serde_json::from_str(&serde_json::to_string(&elsewhere).unwrap().replace("\"a\"", "\"b\"")).unwrap();
    assert!(detector().resume(elsewhere).is_err(), "another structure");
}

/// Between two blocks of 256 rows as well, to rounding.
#[test]
fn a_stream_goes_on_from_its_state() {
    let (basis, h) = (lorenz::basis(), 0.005);
    let rows = lorenz::strong(6, 700, h, 10.0);
    let mut stream = Stream::new(Arc::clone(&basis), h).unwrap();
    for (n, row) in rows.iter().enumerate() {
        stream.push(n as f64 * h, row).unwrap();
        if n % 111 == 0 {
            let state = stream.state().unwrap();
            stream = Stream::resume(Arc::clone(&basis), state).unwrap();
        }
    }
    assert_eq!(stream.n_row(), 701);
    assert!(close(stream.sums().unwrap(), &sums(&basis, &rows, h)));
}

//! Sums and states that come from elsewhere, damaged: refused or used, never a panic.

use std::sync::Arc;

use proptest::prelude::*;
use serde_json::{Value, json};
use starlings_estimators::inference::{
    Detector, DetectorState, Diffusion, Fit, Following, Memory, Structure, Sums, compare, noise_checks,
};

use crate::kit::{lorenz, sums};

const H: f64 = 0.005;

/// Every leaf and every list of a text, in its order.
fn places<'a>(value: &'a mut Value, out: &mut Vec<&'a mut Value>) {
    let inside: Vec<&mut Value> = match value {
        Value::Array(list) if list.iter().all(Value::is_number) && !list.is_empty() => {
            return out.push(value);
        }
        Value::Array(list) => list.iter_mut().collect(),
        Value::Object(map) => map.values_mut().collect(),
        leaf => return out.push(leaf),
    };
    for value in inside {
        places(value, out);
    }
}

/// One place of a text is changed.
fn damage(text: &mut Value, at: usize, how: usize) {
    let mut found = vec![];
    places(text, &mut found);
    let n = found.len();
    let place = &mut *found[at % n];
    match place {
        Value::Array(list) => match how % 4 {
            0 => drop(list.pop()),
            1 => list.push(json!(1.0)),
            2 => list[at % 3] = json!(-1e300),
            _ => list.clear(),
        },
        leaf => {
            *leaf = [json!(0), json!(-1.0), json!(1e308), json!(u64::MAX), json!(null), json!(3)][how % 6]
                .clone();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_sums_are_refused_or_used(at in 0_usize..10_000, how in 0_usize..12, seed in 0_u64..4) {
        let basis = lorenz::basis();
        let structure = lorenz::seven(&basis);
        let whole = sums(&basis, &lorenz::strong(seed, 100, H, 10.0), H);
        let mut text = serde_json::to_value(&whole).unwrap();
        damage(&mut text, at, how);
        let Ok(damaged) = serde_json::from_value::<Sums>(text) else { return Ok(()) };
        let mut merged = whole.clone();
        let _ = merged.merge(&damaged);
        if damaged.check(&basis).is_err() {
            return Ok(());
        }
        for sums in [&damaged, &merged] {
            let fit = Fit { lag_corrected: at % 2 == 0, ..Fit::new(Diffusion::Full, 7) };
            let Ok(posterior) = fit.posterior(sums, &structure) else { continue };
            prop_assert!(posterior.estimates.iter().filter_map(|e| e.value).all(|v| v.mean.is_finite() && v.sd.is_finite()));
            let _ = (noise_checks(sums, &structure, &posterior), compare(&posterior, sums, &structure, &[]));
        }
    }

    #[test]
    fn damaged_states_are_refused_or_used(at in 0_usize..10_000, how in 0_usize..12) {
        let basis = lorenz::basis();
        let structure: Structure = lorenz::seven(&basis);
        let following =
            Following { block: 10, recent: 2, reference: Memory::Growing, least: 50, longer: true, rate: 1e-3, watched: vec![] };
        let detector = || {
            let fit = Fit::new(Diffusion::Full, 7);
            Detector::new(Arc::clone(&basis), H, structure.clone(), fit, following.clone()).unwrap()
        };
        let rows = lorenz::strong(1, 200, H, 10.0);
        let mut running = detector();
        let feed = |detector: &mut Detector, range: std::ops::Range<usize>| {
            range.map(|n| detector.push(n as f64 * H, &rows[n])).find(Result::is_err).is_none()
        };
        prop_assert!(feed(&mut running, 0..151));
        let mut text = serde_json::to_value(running.state().unwrap()).unwrap();
        damage(&mut text, at, how);
        let Ok(state) = serde_json::from_value::<DetectorState>(text) else { return Ok(()) };
        let Ok(mut resumed) = detector().resume(state) else { return Ok(()) };
        let _ = feed(&mut resumed, 151..200);
    }
}

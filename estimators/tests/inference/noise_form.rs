//! Noise that has not the form that a fit holds it to have.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Diffusion, Fit, NoiseForm, Polynomial, Posterior, Rule, Structure, Sums, noise_form,
};

use crate::kit::sde::{gauss, heun, record, rng};
use crate::kit::sums;

const H: f64 = 0.02;

/// A spiral, x' = -x + 2 y and y' = -2 x - y, under noise of this size in y and this correlation with that of x, 0.5.
fn spiral(seed: u64, n: usize, size: f64, shared: f64) -> Vec<[f64; 2]> {
    let mut draw = rng(seed);
    let root = [[0.5, 0.0], [size * shared, size * (1.0 - shared * shared).sqrt()]];
    let drift = |_: f64, [x, y]: &[f64; 2]| [2.0 * y - x, -2.0 * x - y];
    record(n, (H, 4), [0.0, 0.0], |t, h, x| heun(&mut draw, (t, h), x, &root, &drift))
}

fn question(rows: &[[f64; 2]]) -> (Sums, Structure) {
    let linear = Polynomial::new(&["x", "y"], 2, &[0, 1], 1, false);
    let basis = Arc::new(Basis::new(2, 0).with(Rule::MidPoint, linear).unwrap());
    let structure = Structure::same(&basis, &["x", "y"]).unwrap();
    (sums(&basis, rows, H), structure)
}

/// One stated in twenty, over pairs of equations and both questions together.
#[test]
fn noise_of_the_form_is_called_another_as_rarely_as_stated() {
    for form in [Diffusion::Diagonal, Diffusion::Isotropic] {
        let is_told = |seed: u64| {
            let (sums, structure) = question(&spiral(seed, 500, 0.5, 0.0));
            let posterior = Fit::new(form.clone(), 4).posterior(&sums, &structure).unwrap();
            !noise_form(&form, &sums, &structure, &posterior, 0.05).unwrap().is_empty()
        };
        let told = (0..600).filter(|seed| is_told(*seed)).count();
        println!("{form:?}: {told} of 600 where 30 are stated");
        assert!((15..=48).contains(&told), "{form:?}: {told}");
    }
}

#[test]
fn noise_that_is_shared_or_of_two_sizes_is_told_with_how_much() {
    let found = |form: Diffusion, size: f64, shared: f64| {
        let (sums, structure) = question(&spiral(1, 5_000, size, shared));
        let posterior = Fit::new(form.clone(), 4).posterior(&sums, &structure).unwrap();
        noise_form(&form, &sums, &structure, &posterior, 1e-3).unwrap()
    };
    let shared = found(Diffusion::Diagonal, 0.5, -0.6);
    let [NoiseForm::Shared(names, correlation)] = shared.as_slice() else { panic!("{shared:?}") };
    assert!(names == &["x", "y"] && (correlation + 0.6).abs() < 0.05, "{shared:?}");
    let unequal = found(Diffusion::Isotropic, 1.0, 0.0);
    let [NoiseForm::Unequal(_, [of_x, of_y])] = unequal.as_slice() else { panic!("{unequal:?}") };
    assert!((of_x - 0.25).abs() < 0.02 && (of_y - 1.0).abs() < 0.08, "{unequal:?}");
    assert!(found(Diffusion::Diagonal, 1.0, 0.0).is_empty(), "independent noise may have any size");
    assert!(found(Diffusion::Full, 1.0, 0.6).is_empty(), "all is allowed");
}

/// By how many of its standard deviations each coefficient is off, and these beside those of another posterior.
fn compared(of: &Posterior, other: &Posterior) -> Vec<(f64, f64)> {
    let values = |p: &Posterior| p.estimates.iter().map(|e| e.value.unwrap()).collect::<Vec<_>>();
    let pairs = values(of).into_iter().zip(values(other));
    pairs.map(|(a, b)| ((a.mean - b.mean) / b.sd, a.sd / b.sd)).collect()
}

/// The same coefficients as of noise of any form, and as certain; with errors of the measurement, which let D err, as well.
#[test]
fn the_whole_noise_in_the_jacobian_frees_a_form_of_its_bias() {
    for errors in [0.0, 0.02] {
        let mut draw = rng(5);
        let mut rows = spiral(4, 20_000, 0.5, 0.8);
        rows.iter_mut().flatten().for_each(|v| *v += errors * gauss(&mut draw));
        let (sums, structure) = question(&rows);
        let lag_corrected = errors > 0.0;
        let any = Fit { lag_corrected, ..Fit::new(Diffusion::Full, 4) }.posterior(&sums, &structure).unwrap();
        for form in [Diffusion::Diagonal, Diffusion::Isotropic] {
            let held = Fit { lag_corrected, ..Fit::new(form.clone(), 4) };
            let biased = compared(&held.posterior(&sums, &structure).unwrap(), &any);
            assert!(biased.iter().any(|(off, _)| off.abs() > 3.0), "{form:?}, {errors}: {biased:?}");
            let whole = Fit { whole_in_jacobian: true, ..held };
            let freed = compared(&whole.posterior(&sums, &structure).unwrap(), &any);
            let is_right = |(off, sd): &(f64, f64)| off.abs() < 0.1 && (0.9..1.1).contains(sd);
            assert!(freed.iter().all(is_right), "{form:?}, {errors}: {freed:?}");
        }
    }
}

/// Errors of the measurement leave next to nothing of D: no correlation is told from that, and none above 1, where there is none.
#[test]
fn noise_behind_large_errors_is_called_shared_as_rarely_as_stated() {
    for (form, n) in [(Diffusion::Diagonal, 500), (Diffusion::Diagonal, 4_000), (Diffusion::Isotropic, 4_000)]
    {
        let (mut told, mut fitted) = (0, 0);
        for seed in 0..200 {
            let mut draw = rng(1_000 + seed);
            let mut rows = spiral(seed, n, 0.5, 0.0);
            rows.iter_mut().flatten().for_each(|v| *v += 0.2 * gauss(&mut draw));
            let (sums, structure) = question(&rows);
            let fit = Fit { lag_corrected: true, ..Fit::new(form.clone(), 4) };
            let Ok(posterior) = fit.posterior(&sums, &structure) else { continue };
            fitted += 1;
            let found = noise_form(&form, &sums, &structure, &posterior, 0.05).unwrap();
            told += usize::from(!found.is_empty());
            for departs in found {
                let NoiseForm::Shared(_, correlation) = departs else { continue };
                assert!(correlation.abs() <= 1.0, "{correlation}");
            }
        }
        println!("{form:?}, {n} rows: {told} of {fitted} that have a fit, where one in twenty is stated");
        assert!(fitted >= 50 && told * 10 <= fitted, "{form:?}, {n}: {told} of {fitted}");
    }
}

#[test]
fn shared_noise_is_told_behind_errors_too() {
    let mut draw = rng(2);
    let mut rows = spiral(1, 20_000, 0.5, 0.8);
    rows.iter_mut().flatten().for_each(|v| *v += 0.1 * gauss(&mut draw));
    let (sums, structure) = question(&rows);
    let fit = Fit { lag_corrected: true, ..Fit::new(Diffusion::Diagonal, 4) };
    let posterior = fit.posterior(&sums, &structure).unwrap();
    let found = noise_form(&fit.diffusion, &sums, &structure, &posterior, 1e-3).unwrap();
    let [NoiseForm::Shared(_, correlation)] = found.as_slice() else { panic!("{found:?}") };
    assert!((0.6..=1.0).contains(correlation), "{correlation}");
}

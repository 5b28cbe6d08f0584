//! Table 1.4: one and two unknowns of a rocket motor from half a second of pressure.

use starlings_estimators::inference::{Diffusion, Fit, Posterior};

use crate::kit::motor::{self, NOISE, PROPELLANT, THROAT};
use crate::kit::{mean, median, sums};

const H: f64 = 0.001;

fn ignition(seed: u64) -> Vec<[f64; 3]> {
    motor::recording(seed, 500, 1.0, |_| 1.0)
}

#[test]
fn the_throat_is_found_to_a_thousandth_from_half_a_second() {
    let basis = motor::basis();
    let fit = Fit::new(Diffusion::Full, 1);
    let one = |seed| fit.posterior(&sums(&basis, &ignition(seed), H), &motor::throat(&basis)).unwrap();
    let posteriors: Vec<Posterior> = (0..200).map(one).collect();
    let error = median(posteriors.iter().map(|p| (p.mean()[0] / THROAT - 1.0).abs()));
    let noise = mean(posteriors.iter().map(|p| p.diffusion[(0, 0)]));
    println!("a {error:.5}, D {noise:.4}");
    assert!(error < 0.0012);
    // The mean of 200 variances of 500 steps each has an sd of 0.45 %.
    assert!((noise / NOISE - 1.0).abs() < 0.015, "{noise}");
}

#[test]
fn throat_and_propellant_are_told_apart_by_the_ignition_and_hardly_at_equilibrium() {
    let basis = motor::basis();
    let fit = Fit::new(Diffusion::Full, 2);
    let error = |start: f64| {
        let one = |seed| {
            let rows = motor::recording(seed, 500, start, |_| 1.0);
            let posterior = fit.posterior(&sums(&basis, &rows, H), &motor::pair(&basis)).unwrap();
            (posterior.mean()[0] / PROPELLANT - 1.0).abs()
        };
        median((0..100).map(one))
    };
    let (ignition, equilibrium) = (error(1.0), error(motor::equilibrium()));
    println!("propellant {ignition:.4} at ignition, {equilibrium:.4} at equilibrium");
    assert!(ignition < 0.02 && equilibrium > 5.0 * ignition);
}

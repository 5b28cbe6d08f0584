//! How active a chamber is over a period, sampled for an input of the network.
//!
//! Next file to read: [`super::network`].

#![allow(non_snake_case)] // the file's own keys

use std::f64::consts::PI;

use super::super::plan::Samples;

/// Intervals of a period: lines between the samples are off by 10⁻⁵ of a full activation.
const INTERVALS: usize = 1000;
/// Times of a period at which its largest value is looked for.
const FINE: usize = 10_000;

/// Cosine and sine coefficients of a ventricle's elastance over a period, in parts of its systolic one: the constants that
/// svZeroDSolver has from the measurements of Senzaki et al. (1996).
const VENTRICLE: [[f64; 2]; 25] = [
    [0.283_748_803, 0.0],
    [0.031_830_626, -0.374_299_825],
    [-0.209_472_400, -0.018_127_770],
    [0.020_520_047, 0.073_971_113],
    [0.008_316_883, -0.047_249_597],
    [-0.041_677_660, 0.003_212_163],
    [0.000_867_323, 0.019_441_411],
    [-0.001_675_379, -0.005_565_534],
    [-0.011_252_277, 0.003_401_432],
    [-0.000_414_677, 0.008_376_795],
    [0.000_253_749, -0.000_071_880],
    [-0.002_584_966, 0.001_566_861],
    [0.000_584_752, 0.003_143_555],
    [0.000_028_502, -0.000_024_787],
    [0.000_022_961, -0.000_007_476],
    [0.000_018_735, -0.000_001_281],
    [0.000_015_573, 0.000_001_781],
    [0.000_013_133, 0.000_003_494],
    [0.000_011_199, 0.000_004_507],
    [0.000_009_634, 0.000_005_117],
    [0.000_008_343, 0.000_005_481],
    [0.000_007_265, 0.000_005_687],
    [0.000_006_354, 0.000_005_789],
    [0.000_005_575, 0.000_005_821],
    [0.000_004_903, 0.000_005_805],
];

/// The course of an activation.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Up and down as one cosine of length `twitch` from `active` on.
    HalfCosine { active: f64, twitch: f64 },
    /// Up and down as two halves of a cosine, each with its start and duration.
    Cosines { contract: (f64, f64), relax: (f64, f64) },
    /// One cosine of `Tsa` periods that ends at the period's part 1/`tpwave`.
    Wrapping { Tsa: f64, tpwave: f64 },
    /// A ventricle's elastance in parts of its systolic one.
    Fourier,
    /// The same, from zero to one.
    FourierFromZero,
    /// The product of a rising and a falling Hill function of the time since `shift`, in parts of its largest value (Mynard et al. 2012).
    TwoHill { shift: f64, times: [f64; 2], powers: [f64; 2] },
}

impl Shape {
    /// What is wrong with its numbers.
    pub(super) fn check(&self) -> Result<(), String> {
        let lengths = match self {
            Self::HalfCosine { twitch, .. } => vec![("t_twitch", *twitch)],
            Self::Cosines { contract, relax } => {
                vec![("contract_duration", contract.1), ("relax_duration", relax.1)]
            }
            Self::Wrapping { Tsa, tpwave } => vec![("Tsa", *Tsa), ("tpwave", *tpwave)],
            Self::TwoHill { times, powers, .. } => {
                let names = ["tau_1", "tau_2", "m1", "m2"];
                names.into_iter().zip(times.iter().chain(powers).copied()).collect()
            }
            Self::Fourier | Self::FourierFromZero => Vec::new(),
        };
        match lengths.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
            Some((key, value)) => Err(format!("{key} is {value}: give a number above zero")),
            None => Ok(()),
        }
    }

    /// The activation over one period.
    pub(super) fn samples(&self, name: &str, period: f64) -> Samples {
        let times: Vec<f64> = (0..=INTERVALS).map(|k| period * k as f64 / INTERVALS as f64).collect();
        let (least, range) = self.scale(period);
        let mut values: Vec<f64> = times.iter().map(|t| (self.at(*t, period) - least) / range).collect();
        // The end is the start of the next period.
        values[INTERVALS] = values[0];
        Samples { name: name.to_owned(), times, values }
    }

    /// What is zero in the activation, and how much above that is one.
    fn scale(&self, period: f64) -> (f64, f64) {
        let courses = || (0..FINE).map(|k| self.at(period * k as f64 / FINE as f64, period));
        let most = || courses().fold(f64::MIN_POSITIVE, f64::max);
        match self {
            Self::TwoHill { .. } => (0.0, most()),
            Self::FourierFromZero => {
                let least = courses().fold(f64::INFINITY, f64::min);
                (least, most() - least)
            }
            _ => (0.0, 1.0),
        }
    }

    fn at(&self, t: f64, period: f64) -> f64 {
        match self {
            Self::HalfCosine { active, twitch } => {
                let since = t - active;
                if (0.0..=*twitch).contains(&since) { bell(since / twitch) } else { 0.0 }
            }
            Self::Cosines { contract, relax } => {
                let [up, down] =
                    [contract, relax].map(|(start, length)| (t - start).rem_euclid(period) / length);
                if up < 1.0 {
                    bell(0.5 * up)
                } else if down < 1.0 {
                    bell(0.5 + 0.5 * down)
                } else {
                    0.0
                }
            }
            Self::Wrapping { Tsa, tpwave } => {
                let (length, end) = (period * Tsa, period / tpwave);
                let before = (end - t).rem_euclid(period);
                if before <= length { bell(before / length) } else { 0.0 }
            }
            Self::TwoHill { shift, times, powers } => {
                let since = (t - shift).rem_euclid(period);
                let [rise, fall] = [0, 1].map(|k| (since / times[k]).powf(powers[k]));
                // A power that is too large to write is one.
                let risen = if rise.is_finite() { rise / (1.0 + rise) } else { 1.0 };
                risen / (1.0 + fall)
            }
            Self::Fourier | Self::FourierFromZero => {
                let angle = 2.0 * PI * t / period;
                let modes = VENTRICLE.iter().enumerate().map(|(k, [cosine, sine])| {
                    let (sin, cos) = (k as f64 * angle).sin_cos();
                    cosine * cos - sine * sin
                });
                modes.sum()
            }
        }
    }
}

/// From zero at 0 to one at ½ to zero at 1, as a cosine.
fn bell(part: f64) -> f64 {
    0.5 * (1.0 - (2.0 * PI * part).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_activation_rises_to_one_and_is_the_same_at_both_ends_of_the_period() {
        let shapes = [
            Shape::HalfCosine { active: 0.2, twitch: 0.3 },
            Shape::Cosines { contract: (0.2, 0.1), relax: (0.3, 0.3) },
            Shape::Wrapping { Tsa: 0.4, tpwave: 9.0 },
            Shape::TwoHill { shift: 0.2, times: [0.2, 0.4], powers: [1.5, 20.0] },
            Shape::FourierFromZero,
        ];
        for shape in shapes {
            let samples = shape.samples("a", 1.0);
            let most = samples.values.iter().copied().fold(0.0, f64::max);
            // Samples of a cosine of .3 s every millisecond miss its peak by (π · .001 / .3)² / 4.
            assert!((most - 1.0).abs() < 1e-4, "{shape:?}: {most}");
            assert!(samples.values.iter().all(|v| (0.0..=1.0).contains(v)));
            assert_eq!(samples.values[0].to_bits(), samples.values[INTERVALS].to_bits());
        }
    }

    #[test]
    fn an_atrium_contracts_around_the_end_of_the_period() {
        // A cosine of .4 that ends at 1/9: from .711 on, with its peak at .911.
        let shape = Shape::Wrapping { Tsa: 0.4, tpwave: 9.0 };
        for (t, wanted) in [(0.05, bell((1.0 / 9.0 - 0.05) / 0.4)), (0.3, 0.0), (1.0 / 9.0 + 0.8, 1.0)] {
            assert!((shape.at(t, 1.0) - wanted).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn a_ventricle_is_stiffest_after_a_third_of_the_period() {
        let samples = Shape::Fourier.samples("a", 1.0);
        let peak = samples.values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(k, v)| (k, *v));
        let (at, most) = peak.unwrap();
        assert!((250..450).contains(&at) && (most - 1.0).abs() < 0.02, "{at}: {most}");
        assert!(samples.values.iter().all(|v| *v > 0.0));
    }
}

//! The gains at which the page shows the poles, and the poles there.
//!
//! Next file to read: [`super::plane`].

use nalgebra::Complex;
use starlings_models::spectrum::{Follower, ObserverSpectrum, SpectrumError};

/// Positions of the slider; the first is gain zero.
const FRAMES: usize = 121;
/// Rounds of halving the steps of the drawn loci.
const ROUNDS: usize = 4;
/// Way from one gain to the next, as part of the largest shown modulus, that is drawn as a straight line.
const STEP: f64 = 0.02;
/// Gains of a drawn locus at most.
const MOST: usize = 1000;
/// Poles shown, those of conjugate pairs in the upper half plane only.
const SHOWN: usize = 12;

/// The poles of one observer at every gain of the page.
pub(super) struct Ways {
    /// `[pole][gain]`, upper half plane.
    pub(super) poles: Vec<Vec<Complex<f64>>>,
    /// The same poles at as many gains as their curves need: `[pole][gain]`.
    pub(super) loci: Vec<Vec<Complex<f64>>>,
    /// Largest real part of all poles at each gain.
    pub(super) max_re: Vec<f64>,
}

/// Poles without observer that are shown: the slowest, upper half plane.
pub(super) fn shown(poles: &[Complex<f64>], listed: usize) -> Vec<Complex<f64>> {
    poles.iter().take(listed).filter(|pole| pole.im >= 0.0).take(SHOWN).copied().collect()
}

/// Gain zero, then equal steps on a logarithmic scale, from gains that move no pole to see to gains beyond the best of every
/// observer.
pub(super) fn frames(shown: &[Complex<f64>], observers: &[ObserverSpectrum]) -> Vec<f64> {
    let moduli = shown.iter().map(|pole| pole.norm()).filter(|m| *m > 0.0);
    let (slow, fast) = moduli.fold((f64::INFINITY, 0.0_f64), |(lo, hi), m| (lo.min(m), hi.max(m)));
    let fast = if fast > 0.0 { fast } else { 1.0 };
    let best = observers.iter().map(|o| o.best.gain).fold(0.0, f64::max);
    let (lo, hi) = (0.02 * slow.clamp(1e-2 * fast, fast), (20.0 * fast).max((2.0 * best).min(1e3 * fast)));
    let steps = (FRAMES - 2) as f64;
    let at = |k: usize| lo * (hi / lo).powf(k as f64 / steps);
    std::iter::once(0.0).chain((0..FRAMES - 1).map(at)).collect()
}

/// The shown poles of an observer at every gain, and their loci.
///
/// # Errors
///
/// The poles are not found.
pub(super) fn ways(
    observer: &ObserverSpectrum,
    shown: &[Complex<f64>],
    gains: &[f64],
) -> Result<Ways, SpectrumError> {
    let mut poles = Poles { follower: Follower::new(&observer.system), listed: observer.slopes.len(), shown };
    Ok(Ways {
        poles: poles.at(gains)?,
        loci: poles.smooth(gains)?,
        max_re: gains.iter().map(|&gain| observer.system.max_re(gain)).collect::<Result<_, _>>()?,
    })
}

/// The shown poles of one observer.
struct Poles<'a> {
    follower: Follower<'a>,
    listed: usize,
    shown: &'a [Complex<f64>],
}

impl Poles<'_> {
    /// Of every conjugate pair the pole that starts in the upper half plane.
    fn at(&mut self, gains: &[f64]) -> Result<Vec<Vec<Complex<f64>>>, SpectrumError> {
        let all = self.follower.follow(gains, self.listed)?;
        Ok(all.into_iter().filter(|way| way[0].im >= 0.0).take(self.shown.len()).collect())
    }

    /// Where a pole moves far from one gain to the next, gains are put between, so that curves are smooth where poles meet.
    fn smooth(&mut self, frames: &[f64]) -> Result<Vec<Vec<Complex<f64>>>, SpectrumError> {
        let scale = self.shown.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        let mut gains = frames.to_vec();
        let mut poles = self.at(&gains)?;
        for _ in 0..ROUNDS {
            let long = |k: usize| {
                let far = |way: &[Complex<f64>]| way[k].norm().min(way[k + 1].norm()) > 2.0 * scale;
                poles.iter().any(|way| (way[k + 1] - way[k]).norm() > STEP * scale && !far(way))
            };
            let between = (0..gains.len() - 1).filter(|&k| long(k)).map(|k| 0.5 * (gains[k] + gains[k + 1]));
            let between: Vec<f64> = between.collect();
            if between.is_empty() || gains.len() + between.len() > MOST {
                break;
            }
            gains.extend(between);
            gains.sort_by(f64::total_cmp);
            poles = self.at(&gains)?;
        }
        Ok(poles)
    }
}

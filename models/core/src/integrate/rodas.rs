//! The coefficients of RODAS, a stiffly accurate Rosenbrock pair of order 4(3) with six stages (Hairer & Wanner 1996, §IV.7 and
//! §VI.3).
//!
//! For M z' = F(t, z) with a singular M a step solves (M/(γh) − ∂F/∂z) kᵢ = F(t + αᵢh, z + Σ aᵢⱼ kⱼ) + Σ (cᵢⱼ/h) M kⱼ + γᵢ h ∂F/∂t; the
//! new z is the last stage's argument plus the last stage, which is also the error. Next file to read: `rosenbrock.rs`, which
//! takes such steps with dense matrices; models with a structure of their own take them with theirs.

/// Stages of a step.
pub const STAGES: usize = 6;
/// The diagonal coefficient: a step solves with M/(γh) − ∂F/∂z.
pub const GAMMA: f64 = 0.25;
/// Times of the stages within the step.
pub const ALPHA: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// Weights of the rate's time derivative.
pub const TIME: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0];
/// Weights of earlier stages in the state at which a stage takes its rate.
pub const A: [&[f64]; STAGES] = [
    &[],
    &[1.544],
    &[0.946_678_528_081_582_6, 0.255_701_169_898_328_4],
    &[3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7],
    &[1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895],
    &[1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0],
];
/// Weights of earlier stages, divided by the step, in a stage's right-hand side.
pub const C: [&[f64]; STAGES] = [
    &[],
    &[-5.6688],
    &[-2.430_093_356_833_875, -0.206_359_915_709_191_5],
    &[-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16],
    &[7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6],
    &[
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];

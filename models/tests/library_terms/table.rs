//! The effects, their numbers, and the equations with them.

/// One effect in one model.
pub(crate) struct Case {
    pub(crate) bench: &'static str,
    /// Name of the effect, with its place.
    pub(crate) effect: &'static str,
    /// Its amplitude and the other parameters, in their order, in the model's units.
    pub(crate) values: &'static [f64],
    pub(crate) hand: &'static [Hand],
}

/// What is different in the equations.
pub(crate) enum Hand {
    /// A term more in the rate of a state.
    Rate(&'static str, &'static str),
    /// A state more: its name, its initial value and its rate.
    State(&'static str, &'static str, &'static str),
    /// Another value of an output.
    Output(&'static str, &'static str),
    /// An expression instead of an input or a parameter, wherever it stands.
    Instead(&'static str, &'static str),
    /// Another value of a parameter, larger by this.
    Plus(&'static str, f64),
}

use Hand::{Instead, Output, Plus, Rate, State};

const fn case(
    bench: &'static str,
    effect: &'static str,
    values: &'static [f64],
    hand: &'static [Hand],
) -> Case {
    Case { bench, effect, values, hand }
}

/// Every kind of effect but two of the sensors.
pub(crate) const TABLE: &[Case] = &[
    case("pendulum", "viscous-friction", &[2.5], &[Rate("speed", "-2.5*speed")]),
    case("pendulum", "coulomb-friction", &[6.0, 0.1], &[Rate("speed", "-6*tanh(speed/0.1)")]),
    case(
        "pendulum",
        "stribeck-friction",
        &[6.0, 1.5, 0.1],
        &[Rate("speed", "-6*tanh(speed/0.1)*exp(-speed*speed/2.25)")],
    ),
    case(
        "pendulum",
        "quadratic-drag",
        &[0.8],
        &[Rate("speed", "-0.8*(max(speed, 0)*max(speed, 0) - min(speed, 0)*min(speed, 0))")],
    ),
    case("pendulum", "linear-support", &[20.0], &[Rate("speed", "-20*angle")]),
    case("pendulum", "quadratic-stiffness", &[20.0], &[Rate("speed", "-20*angle*angle")]),
    case("pendulum", "cubic-stiffness", &[20.0], &[Rate("speed", "-20*angle*angle*angle")]),
    case(
        "pendulum",
        "dead-zone",
        &[25.0, 0.3],
        &[Rate("speed", "-25*(max(angle - 0.3, 0) + min(angle + 0.3, 0))")],
    ),
    case(
        "pendulum",
        "backlash",
        &[25.0, 0.2, 0.05],
        &[
            Rate("speed", "25*slack"),
            State("slack", "0", "speed - (max(slack - 0.2, 0) + min(slack + 0.2, 0))/0.05"),
        ],
    ),
    case("pendulum", "bias-force", &[-4.0], &[Rate("speed", "-4")]),
    case(
        "pendulum",
        "periodic-forcing",
        &[9.0, 0.4, 0.7],
        &[Rate("speed", "9*(sin(5*pi*t)*cos(0.7) + cos(5*pi*t)*sin(0.7))")],
    ),
    case("pendulum", "gravity-component", &[12.0], &[Rate("speed", "-12*sin(angle)")]),
    case("oscillator", "added-mass", &[0.4], &[Plus("m", 0.4)]),
    case("pipe", "series-resistance", &[0.3], &[Output("pressure", "p + 0.3*flow")]),
    case("pipe", "inertance", &[0.02], &[Output("pressure", "p + 0.02*ddt(flow)")]),
    // The recorded flow is positive throughout.
    case("pipe", "quadratic-loss", &[0.01], &[Output("pressure", "p + 0.01*flow*flow")]),
    case(
        "pipe",
        "turbulent-friction",
        &[0.02],
        &[Rate("i", "-0.02*(max(i, 0)*max(i, 0) - min(i, 0)*min(i, 0))")],
    ),
    case("one tank", "valve-step", &[0.6, 0.4], &[Instead("R", "(R + R*0.6*step(t - 0.4))")]),
    // The record starts at 0.1 here.
    case("one tank", "valve-drift", &[1.5, 0.1], &[Instead("R", "(R*exp(1.5*t - 0.15))")]),
    case("one tank", "leak", &[0.7], &[Rate("h", "-0.7*max(h, 0)^0.5")]),
    case("one tank", "linear-leak", &[0.7], &[Rate("h", "-0.7*h")]),
    case("one tank", "overflow", &[3.0, 0.9], &[Rate("h", "3*min(0.9 - h, 0)")]),
    case("one tank", "bias-flow", &[-0.3], &[Rate("h", "-0.3")]),
    case(
        "two tanks",
        "leak-into:h1:h2",
        &[0.7, 0.4],
        &[Rate("h1", "-0.7*sqrt(h1)"), Rate("h2", "0.28*sqrt(h1)")],
    ),
    case(
        "two tanks",
        "overflow-into:h1:h2",
        &[3.0, 1.8, 0.4],
        &[Rate("h1", "3*min(1.8 - h1, 0)"), Rate("h2", "-1.2*min(1.8 - h1, 0)")],
    ),
    case(
        "two tanks",
        "connection:h1:h2",
        &[2.0, 1.5],
        &[Rate("h1", "2*(h2 - h1)"), Rate("h2", "3*(h1 - h2)")],
    ),
    case(
        "room",
        "second-store",
        &[1.5, 0.4, 290.0],
        &[Rate("T", "1.5*(wall - T)"), State("wall", "290", "0.6*(T - wall)")],
    ),
    case("room", "loss-to-ambient", &[1.5, 270.0], &[Rate("T", "1.5*(270 - T)")]),
    case("room with a thermometer outside", "loss-to-ambient", &[1.5], &[Rate("T", "1.5*(outside - T)")]),
    // It stays warmer than 270 inside.
    case("room", "convective-loss", &[0.05, 270.0], &[Rate("T", "-0.05*(T - 270)^2")]),
    case("room", "heat-from-input", &[2.0], &[Rate("T", "2*sun")]),
    case("room", "bias-heat", &[-30.0], &[Rate("T", "-30")]),
    case("chamber", "throat-step", &[0.5, 0.4], &[Instead("At", "(At + At*0.5*step(t - 0.4))")]),
    case(
        "chamber",
        "throat-erosion",
        &[0.8, 2.0, 0.1],
        &[Instead("At", "(At*(1 + 0.8*max(t - 0.1, 0)*max(t - 0.1, 0)))")],
    ),
    case("chamber", "burn-rate-shift", &[-0.3, 0.4], &[Instead("a", "(a - 0.3*a*step(t - 0.4))")]),
    case("chamber", "uneven-burn-out", &[1.2, 0.3], &[Instead("Ab", "(Ab*max(1 - 1.2*max(w - 0.3, 0), 0))")]),
    case("chamber", "back-pressure", &[0.6], &[Output("thrust", "max(1.4*At*p - 0.6, 0)")]),
    case("ramp", "sensor-offset", &[0.3], &[Output("y", "sin(8*t) + 0.3")]),
    case("ramp", "sensor-step", &[0.3, 0.4], &[Output("y", "sin(8*t) + 0.3*step(t - 0.4)")]),
    case("ramp", "sensor-drift", &[0.3, 0.1], &[Output("y", "sin(8*t) + 0.3*t - 0.03")]),
    case("ramp", "sensor-gain", &[0.3], &[Output("y", "1.3*sin(8*t)")]),
    // What is not known of the time before the record is as at its start.
    case("ramp", "sensor-delay", &[0.2], &[Output("y", "sin(8*max(t - 0.2, 0))")]),
    case("ramp", "sensor-saturation", &[1.0, 0.6], &[Output("y", "min(sin(8*t), 0.6)")]),
    case("ramp", "sensor-saturation", &[0.5, 0.6], &[Output("y", "0.5*sin(8*t) + 0.5*min(sin(8*t), 0.6)")]),
    case("motor", "input-gain", &[0.3], &[Instead("voltage", "(1.3*voltage)")]),
    case("motor", "input-offset", &[-3.0], &[Instead("voltage", "(voltage - 3)")]),
    case("motor", "input-drift", &[5.0, 0.1], &[Instead("voltage", "(voltage + 5*t - 0.5)")]),
    case("motor", "input-delay", &[0.1], &[Instead("voltage", "delay(voltage, 0.1)")]),
    case("pipe", "nonlinear-compliance", &[0.02, 90.0], &[Instead("C", "(C*exp(1.8 - 0.02*p))")]),
    case("artery-1d", "tissue-support", &[1e4], &[Plus("k_s", 1e4)]),
    case("fsi-tube", "wall-viscosity", &[1e4], &[Plus("c_s", 1e4)]),
    case("one tank", "growth", &[0.7], &[Rate("h", "0.7*h")]),
    case("one tank", "loss", &[0.7], &[Rate("h", "-0.7*h")]),
    case("one tank", "source", &[-0.3], &[Rate("h", "-0.3")]),
    case("one tank", "self-limit", &[0.7], &[Rate("h", "-0.7*h^2")]),
    case("two tanks", "coupling:h1:h2", &[0.6], &[Rate("h1", "0.6*h2")]),
    case("two tanks", "interaction:h1:h2", &[-0.6], &[Rate("h1", "-0.6*h1*h2")]),
    // The level stays above zero.
    case("one tank", "saturation", &[0.7, 0.4], &[Rate("h", "-0.7/(1 + 0.4/h)")]),
    case("one tank", "threshold", &[3.0, 0.9], &[Rate("h", "3*min(0.9 - h, 0)")]),
    case(
        "one tank",
        "hidden-store",
        &[1.5, 0.4, 0.7],
        &[Rate("h", "1.5*(behind - h)"), State("behind", "0.7", "0.6*(h - behind)")],
    ),
    case("rcr-network", "external-pressure:Pv_upper", &[1.0], &[Plus("Pv_upper", 1.0)]),
];

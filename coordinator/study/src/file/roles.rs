//! Roles that a study does not write: what the unit of a quantity tells, and the equation x' = v.
//!
//! A written role stands, `other` as well, but that an output which is nothing but a state means what that means. Next file to read: [`super::quantity`].

use starlings_models::Role;
use starlings_models::units::Unit;

use super::StateSection;

/// Units of quantities that have one meaning.
const TOLD: [(&str, Role); 5] = [
    ("K", Role::Temperature),
    ("Pa", Role::Pressure),
    ("m^3/s", Role::Flow),
    ("m/s", Role::Velocity),
    ("N", Role::Force),
];

/// The role of a quantity of this unit; a length may be a displacement or a level, a plain number anything.
pub(super) fn told_by_unit(label: &str) -> Option<Role> {
    let unit = Unit::parse(label)?;
    let is = |known: &str| Unit::parse(known).is_some_and(|known| known.same_dimension(&unit));
    TOLD.iter().find(|(known, _)| is(known)).map(|(_, role)| *role)
}

/// A length or an angle whose rate is nothing but another state is a displacement, and that state its velocity.
pub(super) fn told_by_rates(states: &mut [StateSection]) {
    let rates: Vec<Option<String>> = states.iter().map(only_rate).collect();
    for (i, rate) in rates.iter().enumerate() {
        let Some(j) = rate.as_ref().and_then(|name| states.iter().position(|s| s.name.get_ref() == name))
        else {
            continue;
        };
        if i == j || !is_length_or_angle(&states[i].unit) {
            continue;
        }
        for (state, role) in [(i, Role::Displacement), (j, Role::Velocity)] {
            states[state].role.get_or_insert(role);
        }
    }
}

fn only_rate(state: &StateSection) -> Option<String> {
    match state.rate.as_slice() {
        [(_, term)] => Some(term.get_ref().trim().to_owned()),
        _ => None,
    }
}

fn is_length_or_angle(label: &str) -> bool {
    let metre = Unit::parse("m");
    ["rad", "deg", "°"].contains(&label.trim())
        || Unit::parse(label).zip(metre).is_some_and(|(unit, metre)| unit.same_dimension(&metre))
}

#[cfg(test)]
mod tests {
    use toml::Spanned;

    use super::*;

    fn state(name: &str, unit: &str, rate: &str) -> StateSection {
        let text = |t: &str| Spanned::new(0..0, t.to_owned());
        StateSection {
            name: text(name),
            unit: unit.to_owned(),
            role: told_by_unit(unit),
            initial: text("0"),
            rate: vec![(text(""), text(rate))],
            noise: Vec::new(),
        }
    }

    #[test]
    fn units_tell_what_has_one_meaning_and_lengths_and_numbers_nothing() {
        let roles = ["degC", "mmHg", "mL/s", "km/h", "kN"].map(told_by_unit);
        assert_eq!(
            roles,
            [Role::Temperature, Role::Pressure, Role::Flow, Role::Velocity, Role::Force].map(Some)
        );
        for label in ["", "1", "m", "kg", "rad/s", "parrots"] {
            assert_eq!(told_by_unit(label), None, "{label}");
        }
    }

    #[test]
    fn what_moves_at_another_state_is_a_displacement() {
        let told = |states: [StateSection; 2]| {
            let mut states = states;
            told_by_rates(&mut states);
            states.map(|s| s.role)
        };
        let moving = [Role::Displacement, Role::Velocity].map(Some);
        assert_eq!(told([state("angle", "rad", " speed "), state("speed", "rad/s", "-k*angle")]), moving);
        assert_eq!(told([state("x", "m", "v"), state("v", "m/s", "-k*x")]), moving);
        assert_eq!(
            told([state("h", "m", "-c*sqrt(h)"), state("v", "m/s", "-k*h")]),
            [None, Some(Role::Velocity)]
        );
        assert_eq!(told([state("q", "C", "i"), state("i", "A", "-q/L")]), [None; 2], "a charge");
        let written = StateSection { role: Some(Role::Other), ..state("x", "m", "v") };
        assert_eq!(told([written, state("v", "m/s", "-k*x")]), [Role::Other, Role::Velocity].map(Some));
    }
}

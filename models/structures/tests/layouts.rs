//! Layouts that cannot be are refused with the place and the remedy.
#![allow(clippy::unwrap_used)]

use serde_json::{Value, json};
use starlings_models_core::ModelDef;
use starlings_structures::MODELS;

/// What the model of this kind says of a layout; empty when it takes it.
fn told(kind: &str, layout: Value) -> String {
    let native = MODELS.iter().find(|native| native.kind == kind).unwrap();
    let def = ModelDef { kind: kind.to_owned(), layout: Some(layout), ..ModelDef::default() };
    (native.build)(&def).err().map_or(String::new(), |error| error.to_string())
}

fn compare(kind: &str, cases: &[(Value, &str)]) {
    assert_eq!(told(kind, json!({})), "", "{kind}");
    for (layout, expected) in cases {
        let told = told(kind, layout.clone());
        assert!(told.contains(expected), "{kind}, {layout}: {told}");
    }
}

#[test]
fn a_plate_that_cannot_be_is_refused() {
    compare(
        "plate",
        &[
            (json!({ "length": [2.0, -1.0] }), "at `length[1]`: a plate of -1 m"),
            (json!({ "modes": [0, 4] }), "at `modes`: 0 x 4 modes: give at least one"),
            (json!({ "modes": [100, 100] }), "at most 1600 in all"),
            (json!({ "sensors": [] }), "at `sensors`: 0 sensors: give 1 to"),
            (
                json!({ "sensors": [[0.3, 0.4], [2.0, 0.4]] }),
                "at `sensors[1]`: (2, 0.4) is not inside the plate",
            ),
            (json!({ "source": [0.0, 0.4] }), "at `source`: (0, 0.4) is not inside"),
            (json!({ "mode": [4, 4] }), "did you mean `modes`?"),
        ],
    );
}

#[test]
fn a_conical_shell_that_cannot_be_is_refused() {
    compare(
        "conical-shell",
        &[
            (json!({ "half_angle": 90.0 }), "at `half_angle`: 90 degrees is no cone"),
            (json!({ "ends": [3.0, 1.5] }), "at `ends`: a shell from 3 m to 1.5 m"),
            (json!({ "waves": [] }), "at `waves`: 0 modes in all"),
            (json!({ "waves": [5, 0] }), "at `waves[1]`: no wave around"),
            (json!({ "waves": [5, 6, 5] }), "at `waves[2]`: 5 waves are given twice"),
            (json!({ "modes": 9 }), "at `modes`: 9 modes from 16 functions: give 1 to 8"),
            (json!({ "terms": 60 }), "at `terms`: 60 functions: give 4 to 40"),
            (json!({ "source": 1.5 }), "at `source`: s = 1.5 m at 0 degrees is not on the shell"),
            (json!({ "sensors": [[3.1, 0.0]] }), "at `sensors[0]`: s = 3.1 m"),
        ],
    );
}

#[test]
fn a_nozzle_with_an_unknown_actuator_is_refused() {
    compare("thrust-vector-control", &[(json!({ "actuator": "laws" }), "did you mean `law`?")]);
}

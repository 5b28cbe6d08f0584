//! Layouts that make no system are refused, with their place.

use serde_json::{Value, json};

use crate::kit::build;

fn refused(kind: &str, layout: &Value, place: &str, says: &str) {
    let Err(error) = build(kind, layout.clone()) else { panic!("{layout} was taken") };
    let text = error.to_string();
    assert!(text.contains(&format!("`{place}`")) && text.contains(says), "{layout}: {text}");
}

#[test]
fn a_layout_that_makes_no_system_is_refused() {
    let elements = |more: Value| {
        let mut layout = json!({ "discretisation": "elements" });
        layout.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        layout
    };
    refused("toy-fsi", &json!({ "modes": 0 }), "modes", "from 1");
    refused("toy-fsi", &json!({ "modes": 100_000 }), "modes", "to 1000");
    refused("toy-fsi", &json!({ "cells": [40, 8] }), "cells", "discretisation");
    refused("toy-fsi", &elements(json!({ "modes": 12 })), "modes", "discretisation");
    refused("toy-fsi", &elements(json!({ "cells": [1, 8] })), "cells[0]", "from 2");
    refused("toy-fsi", &elements(json!({ "cells": [4, 0] })), "cells[1]", "from 1");
    refused("toy-fsi", &elements(json!({ "thickness_wave": -1.0 })), "thickness_wave", "above -1");
    refused("toy-fsi", &json!({ "discretisation": "waves" }), "discretisation", "elements");
    refused("toy-fsi-windkessel", &json!({ "modes": 0 }), "modes", "from 1");
    refused("toy-fsi-stokes", &json!({ "polynomials": 0 }), "polynomials", "from 1");
    refused("toy-fsi-stokes", &json!({ "modes": 100, "polynomials": 100 }), "modes", "to 1000");
}

#[test]
fn the_first_key_that_is_unknown_is_named() {
    for kind in ["toy-fsi", "toy-fsi-windkessel", "toy-fsi-stokes"] {
        let Err(error) = build(kind, json!({ "mode": 3 })) else { panic!("an unknown key was taken") };
        assert!(error.to_string().contains("`mode`"), "{error}");
    }
}

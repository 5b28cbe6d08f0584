//! The tube's layout: regions, where a run starts, and what is refused.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod fsi_tube_kit;

use fsi_tube_kit::NoHistory;
use serde_json::{Value, json};
use starlings_haemodynamics::MODELS;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Model, ModelDef, ModelFailure, SetupError};

fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    (MODELS.iter().find(|native| native.kind == def.kind).unwrap().build)(def)
}

fn built(layout: Value) -> Result<Box<dyn Model>, String> {
    let model = ModelDef { kind: "fsi-tube".to_owned(), layout: Some(layout), ..ModelDef::default() };
    build(&model).map_err(|error| error.to_string())
}

/// Initial displacements with E1, E2, ... of 1, 2, ... times the default.
fn displacement(model: &dyn Model) -> Vec<f64> {
    let list = &model.spec().parameters;
    let mut theta: Vec<f64> = list.iter().map(|q| q.default.unwrap()).collect();
    for (i, value) in theta.iter_mut().enumerate().take_while(|(i, _)| list[*i].name == format!("E{}", i + 1))
    {
        *value *= i as f64 + 1.0;
    }
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut x);
    x.truncate(model.spec().states[0].size);
    x
}

fn strap(second: (f64, f64)) -> Value {
    json!({ "cells": 10, "regions": [
        { "name": "strap", "from": 0.0, "to": 5.0 },
        { "name": "free", "from": second.0, "to": second.1 },
    ] })
}

#[test]
fn equal_regions_share_the_cells_by_their_centres() {
    let model = built(json!({ "cells": 7, "regions": 3 })).unwrap();
    let eta = displacement(&*model);
    // Centres at 1/14, 3/14, 5/14, ... of the length; thirds end at 14/3 and 28/3 of these fourteenths.
    let region: Vec<usize> = eta.iter().map(|v| (eta[0] / v).round() as usize).collect();
    assert_eq!(region, [1, 1, 2, 2, 2, 3, 3]);
    assert_eq!(model.spec().parameters[3].name, "E_ref");
}

#[test]
fn listed_regions_are_parameters_in_their_order_and_named_in_words() {
    let model = built(strap((5.0, 25.0))).unwrap();
    let eta = displacement(&*model);
    assert!(
        eta[..2].iter().all(|v| *v == eta[0]) && eta[2..].iter().all(|v| (v - 0.5 * eta[0]).abs() < 1e-15)
    );
    assert_eq!(model.spec().parameters[0].says, "Young's modulus of region `strap`, 0 to 5 cm.");
    assert_eq!(model.spec().parameters[1].name, "E2");
}

#[test]
fn a_listed_tube_of_another_length_is_covered_by_that_length() {
    let mut def =
        ModelDef { kind: "fsi-tube".to_owned(), layout: Some(strap((5.0, 10.0))), ..ModelDef::default() };
    def.constants.insert("L".to_owned(), 10.0);
    let model = build(&def).unwrap();
    let eta = displacement(&*model);
    assert_eq!(eta.iter().filter(|v| **v == eta[0]).count(), 5);
}

#[test]
fn a_start_by_the_reference_does_not_know_the_regions() {
    let model = built(json!({ "start": "reference" })).unwrap();
    let eta = displacement(&*model);
    // 80 mmHg over E h/((1 − ν²)R²) = 1e6 dyn/cm³.
    assert!(eta.iter().all(|v| (v - 80.0 * 1333.22 / 1e6).abs() < 1e-15), "{eta:?}");
    let model = built(json!({ "start": "equilibrium" })).unwrap();
    let eta = displacement(&*model);
    assert!((eta[24] - eta[0] / 5.0).abs() < 1e-15, "{eta:?}");
}

#[test]
fn a_span_of_more_steps_than_anybody_waits_for_fails_at_its_start() {
    let model = built(json!({ "step": 1e-6 })).unwrap();
    let theta: Vec<f64> = model.spec().parameters.iter().map(|q| q.default.unwrap()).collect();
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut x);
    let limits = Limits::none();
    let segment = |t1: f64| Segment {
        t0: 2.0,
        t1,
        u0: &[0.0],
        slope: &[0.0],
        history: &NoHistory,
        limits: &limits,
        noise: None,
    };
    // 2e8 steps.
    let failed = model.advance(segment(202.0), &theta, &mut x).unwrap_err();
    assert_eq!(failed, ModelFailure::TooManySteps { time: 2.0, limit: 100_000_000 });
    // And a thousand, on the way.
    model.advance(segment(2.0 + 1e-3), &theta, &mut x).unwrap();
}

#[test]
fn what_cannot_be_is_refused_with_its_place_and_a_remedy() {
    let cases = [
        (strap((6.0, 25.0)), "`regions[1].from`: no region covers 5 to 6 cm: start `free` at 5"),
        (strap((4.0, 25.0)), "`regions[1].from`: two regions cover 4 to 5 cm: start `free` at 5"),
        (
            strap((5.0, 24.0)),
            "`regions[1].to`: the last region, `free`, ends at 24 cm and the tube at L = 25 cm",
        ),
        (strap((5.0, 26.0)), "ends at 26 cm and the tube at L = 25 cm"),
        (strap((5.0, 5.0)), "`regions[1].to`: `free` ends at 5 cm and starts at 5 cm"),
        (json!({ "cells": 0 }), "`cells`: 0 cells"),
        (json!({ "cells": 3, "regions": 4 }), "`regions`: 4 regions for 3 cells"),
        (json!({ "regions": 0 }), "`regions`: 0 regions"),
        (json!({ "regions": [] }), "`regions`: no regions"),
        (json!({ "step": 0.0 }), "`step`: a step of 0 s"),
        (json!({ "step": 9.9e-7 }), "give a time of 1e-6 s or more"),
        (json!({ "step": "short" }), "`step`: invalid type"),
        (json!({ "regions": "many" }), "a number of equal regions, or a list"),
        (json!({ "start": "middle" }), "`equilibrium` or `reference`"),
        (json!({ "cell": 25 }), "unknown field `cell`"),
        (json!({ "regions": [{ "name": "a", "from": 0.0 }] }), "`regions[0]`: missing field `to`"),
        (
            json!({ "cells": 2, "regions": [
                { "name": "a", "from": 0.0, "to": 1.0 }, { "name": "b", "from": 1.0, "to": 25.0 } ] }),
            "`regions[0]`: `a` is too short to hold the centre of one of 2 cells",
        ),
        (
            json!({ "regions": [
                { "name": "a", "from": 0.0, "to": 12.5 }, { "name": "a", "from": 12.5, "to": 25.0 } ] }),
            "`regions[1].name`: two regions are named `a`",
        ),
    ];
    for (layout, said) in cases {
        let text = layout.to_string();
        let Err(error) = built(layout) else { panic!("{text} was accepted") };
        assert!(error.contains(said), "{text}: {error}");
    }
}

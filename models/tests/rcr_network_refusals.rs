//! What a netlist may not say, and where its refusal points.

use serde_json::{Value, json};
use starlings_models::{BuildSetup, ModelDef, Setup, SetupError};

/// Path and message of a refusal.
fn refusal(layout: Value) -> (String, String) {
    let model = ModelDef { kind: "rcr-network".to_owned(), layout: Some(layout), ..ModelDef::default() };
    match (Setup { model, ..Setup::default() }).spec() {
        Err(SetupError::Layout { path, message }) => (path, message),
        other => panic!("not refused: {other:?}"),
    }
}

#[allow(clippy::needless_pass_by_value, reason = "netlists are written where they are used")]
#[track_caller]
fn refused(elements: Value, at: &str, says: &[&str]) {
    let (path, message) = refusal(json!({ "elements": elements }));
    assert_eq!(path, at, "{message}");
    for text in says {
        assert!(message.contains(text), "`{text}` is not in: {message}");
    }
}

fn c(name: &str, from: &str, to: &str) -> Value {
    json!({ "name": name, "kind": "C", "from": from, "to": to, "value": 1.0 })
}

fn r(name: &str, from: &str, to: &str) -> Value {
    json!({ "name": name, "kind": "R", "from": from, "to": to, "value": 1.0 })
}

fn l(name: &str, from: &str, to: &str) -> Value {
    json!({ "name": name, "kind": "L", "from": from, "to": to, "value": 1.0 })
}

#[test]
fn a_floating_node_is_refused_with_the_remedy() {
    let elements =
        json!([c("wall", "a", "0"), r("out", "a", "0"), r("island", "b", "x"), c("sea", "x", "b")]);
    refused(
        elements,
        "elements[2].from",
        &["`b`", "`x`", "no path to the ground", "resistance or a capacitor"],
    );
    let (path, message) =
        refusal(json!({ "nodes": [{ "name": "a" }, { "name": "spare" }], "elements": [r("out", "a", "0")] }));
    assert_eq!(path, "nodes[1]");
    assert!(message.contains("`spare`") && message.contains("remove"), "{message}");
}

#[test]
fn a_node_between_inertances_alone_is_refused_with_their_names() {
    let elements =
        json!([c("wall", "a", "0"), l("first", "a", "b"), l("second", "b", "d"), r("out", "d", "0")]);
    refused(elements, "elements[1].to", &["`first`, `second`", "node `b`", "add a capacitor"]);
    let inflow = json!({ "name": "inflow", "kind": "flow", "to": "a" });
    refused(
        json!([inflow, l("blood", "a", "b"), r("out", "b", "0")]),
        "elements[0].to",
        &["`blood`, `inflow`"],
    );
}

#[test]
fn a_loop_of_capacitors_and_pressure_sources_is_refused_with_their_names() {
    let source = json!({ "name": "heart", "kind": "pressure", "to": "a" });
    let elements = json!([source, c("wall", "a", "0"), c("far", "b", "0"), r("link", "a", "b")]);
    refused(elements, "elements[1]", &["`heart`, `wall`", "twice", "put a resistance into the loop"]);
    let elements = json!([
        c("one", "a", "0"),
        c("two", "a", "b"),
        c("three", "b", "0"),
        c("tail", "b", "d"),
        r("x", "d", "0")
    ]);
    refused(elements, "elements[1]", &["`one`, `two`, `three`"]);
}

#[test]
fn unknown_and_misspelt_nodes_are_refused() {
    let layout = json!({ "nodes": [{ "name": "aorta" }], "elements": [r("out", "aorta", "0"), c("wall", "aorat", "0")] });
    let (path, message) = refusal(layout);
    assert_eq!(path, "elements[1].from");
    assert!(message.contains("did you mean `aorta`"), "{message}");
    let elements = json!([r("out", "aorta", "vein"), c("wall", "aorta", "0"), r("side", "vein", "aorat")]);
    refused(
        elements,
        "elements[2].to",
        &["only one element ends at node `aorat`: did you mean `aorta`? Otherwise declare all nodes"],
    );
    // The other end of the same element is no candidate, near as its name is.
    let (path, message) =
        refusal(json!({ "elements": [r("out", "x", "0"), c("wall", "x", "0"), r("side", "a1", "a2")] }));
    assert_eq!(path, "elements[2].from");
    assert_eq!(message, "only one element ends at node `a1`: if that is meant, declare all nodes in `nodes`");
}

#[test]
fn names_that_are_given_twice_or_are_no_names_are_refused() {
    refused(
        json!([r("a", "x", "0"), c("a", "x", "0")]),
        "elements[1].name",
        &["another element is named `a`"],
    );
    refused(json!([r("a b", "x", "0")]), "elements[0].name", &["letters, digits"]);
    let (path, _) =
        refusal(json!({ "nodes": [{ "name": "x" }, { "name": "x" }], "elements": [r("a", "x", "0")] }));
    assert_eq!(path, "nodes[1].name");
    let rcr = json!({ "name": "x", "kind": "rcr", "from": "x" });
    refused(json!([r("a", "x", "0"), rcr]), "elements[1]", &["chamber of `x`", "rename"]);
}

#[test]
fn an_element_that_joins_a_node_with_itself_or_nothing_is_refused() {
    refused(json!([r("loop", "a", "a")]), "elements[0]", &["both ends of `loop` are node `a`"]);
    refused(json!([{ "name": "out", "kind": "R", "value": 1.0 }]), "elements[0]", &["needs `from`"]);
    refused(json!([{ "name": "in", "kind": "flow" }]), "elements[0]", &["needs `to`"]);
    refused(json!([]), "elements", &["needs elements"]);
}

#[test]
fn keys_and_values_that_do_not_belong_to_an_element_are_refused() {
    let wrong_key = json!({ "name": "a", "kind": "R", "from": "x", "compliance": 1.0 });
    refused(json!([wrong_key]), "elements[0].compliance", &["`R` has no `compliance`", "`value`"]);
    let negative = json!({ "name": "a", "kind": "R", "from": "x", "value": -1.0 });
    refused(json!([negative]), "elements[0].value", &["no resistance has the value -1"]);
    let empty = json!({ "name": "wall", "kind": "C", "from": "x", "value": 0.0 });
    refused(
        json!([empty]),
        "elements[0].value",
        &["`C_wall`: no compliance has the value 0", "leave the element out"],
    );
    let light = json!({ "name": "blood", "kind": "L", "from": "x", "value": 0.0 });
    refused(json!([light]), "elements[0].value", &["`L_blood`: no inertance has the value 0", "leave"]);
    let text = json!({ "name": "a", "kind": "R", "from": "x", "value": [1.0] });
    refused(json!([text]), "elements[0].value", &["a number or the name of a parameter"]);
    let kind = json!({ "name": "a", "kind": "resistor", "from": "x" });
    refused(json!([kind]), "elements[0].kind", &["unknown variant `resistor`", "`R`"]);
    let smooth = json!({ "name": "a", "kind": "diode", "from": "x", "smooth": -1.0 });
    refused(json!([smooth]), "elements[0].smooth", &["positive"]);
    let backwards = json!({ "name": "a", "kind": "diode", "from": "x", "open": 1e4, "closed": 0.02 });
    refused(json!([backwards]), "elements[0].closed", &["0.02 closed is less than 10000 open"]);
    let both = json!({ "name": "a", "kind": "pressure", "to": "x", "value": 1.0, "input": "p" });
    refused(json!([both]), "elements[0]", &["remove one of the two"]);
}

#[test]
fn one_name_for_values_of_two_kinds_is_refused() {
    let shared = json!([{ "name": "a", "kind": "R", "from": "x", "value": "k" }, { "name": "b", "kind": "C", "from": "x", "value": "k" }]);
    refused(shared, "elements[1].value", &["`k` cannot be a resistance and a compliance"]);
    let input = json!([{ "name": "a", "kind": "flow", "to": "x", "input": "s" }, { "name": "b", "kind": "C", "from": "x", "value": 1.0, "input": "s" }]);
    refused(input, "elements[1].input", &["`s` cannot be a pressure and a flow"]);
}

#[test]
fn a_start_of_what_stores_nothing_or_starts_elsewhere_is_refused() {
    let layout = json!({ "nodes": [{ "name": "a", "initial": 3.0 }], "elements": [r("out", "a", "0")] });
    let (path, message) = refusal(layout);
    assert_eq!(path, "nodes[0].initial");
    assert!(message.contains("no capacitor"), "{message}");
    let second = json!({ "name": "two", "kind": "C", "from": "a", "value": 1.0, "initial": 3.0 });
    refused(json!([c("one", "a", "0"), second]), "elements[1].initial", &["`one`"]);
}

#[test]
fn a_gauge_at_an_unknown_node_is_refused() {
    let gauge = json!([{ "name": "drop", "from": "asc", "to": "dsec" }]);
    let elements = json!([c("wall", "asc", "0"), r("narrow", "asc", "desc"), r("out", "desc", "0")]);
    let (path, message) = refusal(json!({ "elements": elements, "gauges": gauge }));
    assert_eq!(path, "gauges[0].to");
    assert!(message.contains("did you mean `desc`"), "{message}");
}

#[test]
fn chambers_and_what_belongs_to_them_are_refused_where_they_do_not_fit() {
    let chamber = json!({ "name": "lv", "kind": "chamber", "from": "a", "active": 2.0 });
    refused(
        json!([chamber, c("wall", "a", "0"), r("out", "a", "0")]),
        "elements[1]",
        &["`lv`", "`wall`", "loop"],
    );
    refused(
        json!([c("wall", "a", "0"), chamber, r("out", "a", "0")]),
        "elements[1]",
        &["`wall`", "resistance"],
    );
    let half = json!({ "name": "lv", "kind": "chamber", "from": "a", "active": 2.0, "wall": 9.0 });
    refused(json!([half, r("out", "a", "0")]), "elements[0]", &["`wall` and `stiffening`, or neither"]);
    let soft = json!({ "name": "lv", "kind": "chamber", "from": "a", "active": 0.1, "passive": 2.0 });
    refused(json!([soft, r("out", "a", "0")]), "elements[0].active", &["softer active", "exchanged"]);
    let under = json!({ "name": "muscle", "kind": "C", "from": "m", "around": "b" });
    let elements = json!([under, r("x", "m", "b"), r("y", "b", "0")]);
    refused(elements, "elements[0].around", &["no chamber to the ground is at node `b`"]);
    let share = json!({ "name": "muscle", "kind": "C", "from": "m", "share": 0.5 });
    refused(json!([share, r("x", "m", "0")]), "elements[0].share", &["needs `around`"]);
    let two = json!({ "name": "v", "kind": "diode", "from": "m", "smooth": 1.0, "steepness": 5.0 });
    refused(json!([two, c("x", "m", "0")]), "elements[0]", &["remove one of the two"]);
    let flat = json!({ "name": "v", "kind": "diode", "from": "m", "steepness": 0.0 });
    refused(json!([flat, c("x", "m", "0")]), "elements[0].steepness", &["not above zero"]);
}

#[test]
fn a_tolerance_that_is_none_is_refused() {
    let (at, says) = refusal(json!({ "tolerance": 0.5, "elements": [c("x", "m", "0")] }));
    assert!(at == "tolerance" && says.contains("between 1e-12 and 0.01"), "{at}: {says}");
}

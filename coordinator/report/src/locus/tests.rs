//! The page of a root locus: self-contained, with a place for every pole.
//!
//! Next file to read: [`super::view`].

use starlings_models::catalogue::NATIVE;
use starlings_models::spectrum::{Decay, LinearisedSetup};
use starlings_models::{BuildSetup, ModelDef, Setup};

use super::{Locus, render};
use crate::tests::page::without_scripts;

fn page() -> String {
    let constants = [("m", 1.0), ("c", 0.2), ("k", 100.0)].map(|(name, value)| (name.to_owned(), value));
    let outputs = vec!["position".to_owned(), "velocity".to_owned()];
    let model =
        ModelDef { kind: "oscillator".to_owned(), constants: constants.into(), ..ModelDef::default() };
    let setup = Setup { model, outputs: outputs.clone(), ..Setup::default() };
    let laboratory =
        LinearisedSetup::new(setup.model().expect("a model"), &setup, &[], NATIVE).expect("linear");
    let decay = Decay::new(10.0, 1.0).expect("a decay");
    let examine = |kind| laboratory.examine(kind, &[0.0, 10.0, 20.0], 2, Some(decay)).expect("hosted");
    let observers = ["sdf", "nudging"].map(examine);
    render(&Locus {
        study: "swing </script> & co",
        says: "",
        model: "oscillator",
        time_unit: "s",
        outputs: &outputs,
        poles: laboratory.poles(),
        listed: 2,
        decay: Some(decay),
        observers: &observers,
        refused: &[("windkessel".to_owned(), "no <outlet>".to_owned())],
    })
    .expect("drawn")
}

#[test]
fn the_page_refers_to_nothing_outside_itself_and_shows_no_invalid_number() {
    let page = page();
    let namespace = "http://www.w3.org/2000/svg";
    assert!(!page.replace(namespace, "").contains("http"), "no address");
    for bad in ["NaN", "inf ", "Infinity", "undefined"] {
        assert!(!without_scripts(&page).contains(bad), "{bad}");
    }
    assert_eq!(without_scripts(&page).matches("<svg").count(), 2);
    assert_eq!(page.matches("</script>").count(), 5, "text of the study cannot close a script");
    assert!(page.contains("no &lt;outlet&gt;"));
}

#[test]
fn the_script_gets_a_place_for_every_pole_at_every_gain() {
    let page = page();
    let data =
        page.split("id=\"data\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("data");
    let data: serde_json::Value = serde_json::from_str(data).expect("JSON");
    let gains = data["gain"].as_array().expect("gains").len();
    assert_eq!(gains, 121);
    assert_eq!(data["cursor"].as_array().map(Vec::len), Some(gains));
    let places = data["place"].as_array().expect("observers");
    assert_eq!(places.len(), 2);
    for of_observer in places {
        let poles = of_observer.as_array().expect("poles");
        assert_eq!(poles.len(), 1, "one of a conjugate pair");
        assert_eq!(poles[0].as_array().map(Vec::len), Some(gains));
        assert!(poles[0][0].is_array(), "the start lies inside the plane");
    }
}

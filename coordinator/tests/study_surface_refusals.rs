//! Files that hold no valid surface: each refused with its file, line and remedy.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]
mod study_kit;
mod wall_kit;

use study_kit::{csv, grid};
use wall_kit::{SURFACE, problem, study};

const PROFILES: &str = "time,z,r\n0,0,1\n0,25,1\n0.02,0,1\n0.02,25,1\n";
const REST: &str = "z,r\n2.5,1\n7.5,1\n12.5,1\n17.5,1\n22.5,1\n";

/// The only problem of a study with these files.
fn said(channel: &str, profiles: &str, rest: &str) -> String {
    let flow = csv("time,flow,zero", &[&grid(11, 0.02), &[0.0; 11], &[0.0; 11]]);
    let files = [("flow.csv", flow), ("profiles.csv", profiles.to_owned()), ("rest.csv", rest.to_owned())];
    problem(&study(channel), &files)
}

#[test]
fn a_profile_that_is_no_wall_is_refused() {
    let cases = [
        ("0.02,0,1\n0.02,25,1", "0.02,25,1\n0.02,0,1", "profiles.csv:4:", "reverse the order"),
        ("0.02,25,1\n", "", "profiles.csv:4:", "1 points: give two or more"),
        ("0.02,25,1", "0.02,25,", "profiles.csv:5:", "has no value here"),
        ("0.02,25,1", "0.02,25,-1", "profiles.csv:4:", "r above zero"),
        ("0.02,", "0.03,", "profiles.csv:4:", "no row at time 0.03"),
        ("0.02,25,1\n", "0.02,25,1\n0,0,1\n", "profiles.csv:6:", "time goes back"),
        ("time,z,r", "time,x,r", "profiles.csv:2:", "has not the columns"),
        (PROFILES, "time,file\n0,none.off\n", "profiles.csv:2:", "there is no such file"),
    ];
    for (good, bad, place, words) in cases {
        let said = said(SURFACE, &PROFILES.replace(good, bad), REST);
        assert!(said.starts_with(place) && said.contains(words), "{words}: {said}");
    }
}

#[test]
fn nodes_at_rest_that_do_not_fit_the_output_are_refused() {
    let flat = REST.replace("z,r", "z,r,nz,nr").replace(",1\n", ",1,0,0\n");
    let cases = [
        (REST.replace("22.5,1\n", ""), "rest.csv:2:", "4 nodes at rest for the 5 components"),
        ("z,r\n9,1\n7,1\n5,1\n3,1\n1,1\n".to_owned(), "rest.csv:2:", "order the nodes"),
        (REST.replace("7.5,1", "7.5,"), "rest.csv:3:", "has no value here"),
        (REST.replace("z,r", "z,x"), "rest.csv:2:", "needed beside profiles"),
        (flat, "rest.csv:2:", "without a direction"),
        (REST.replace(".5,1", "9.5,1"), "study.toml:16:", "no node of `rest.csv` is shown"),
    ];
    for (rest, place, words) in cases {
        let said = said(SURFACE, PROFILES, &rest);
        assert!(said.starts_with(place) && said.contains(words), "{words}: {said}");
    }
}

#[test]
fn a_channel_of_a_surface_with_the_keys_of_another_is_refused() {
    let cases = [
        (SURFACE.replace("0.01", "\"auto\""), "along its normal"),
        (SURFACE.replace("0.01", "-1"), "above zero"),
        (SURFACE.replace(", rest = \"rest.csv\"", ""), "needs `rest`"),
        (format!("{SURFACE}, from = \"rate\""), "no `from`"),
        (format!("{SURFACE}, column = \"zero\""), "no `column`"),
        (
            r#"column = "zero", output = "pressure", noise = 1, rest = "rest.csv""#.to_owned(),
            "belongs to a `surface`",
        ),
        (SURFACE.replace("\"displacement\"", "\"displacment\""), "did you mean `displacement`"),
        (SURFACE.replace("\"displacement\"", "\"velocity\""), "is no displacement"),
        (SURFACE.replace("profiles.csv", "profile.csv"), "did you mean `profiles.csv`"),
    ];
    for (channel, words) in cases {
        let said = said(&channel, PROFILES, REST);
        assert!(said.starts_with("study.toml:16:") && said.contains(words), "{words}: {said}");
    }
}

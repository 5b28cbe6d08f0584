//! Closed loops, chambers and valves, and a network of a patient's size.

use super::{
    TempDir, VESSEL, Value, difference, file, import, json, predicted, refused, results, starlings, table,
};

#[test]
fn a_closed_loop_beats_as_its_equations_do_in_small_steps() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("loop");
    import(&file("svzerodsolver/closedLoopHeart_singleVessel.json"), &out);
    let found = predicted(&out);
    let fine = file("svzerodsolver/closedLoopHeart_singleVessel_fine.csv");
    let fine = table(&std::fs::read_to_string(fine).unwrap());
    let waveforms =
        [("flow_in", "q_branch0_seg0"), ("pressure_in", "p_aorta"), ("pressure_out", "p_branch0_seg0_out")];
    for (column, name) in waveforms {
        let most = difference(&found, name, &fine["time"], &fine[column]);
        // Valves that open over a thousandth of the blood per period, and lines between samples of the steepest rise.
        assert!(most <= 1e-3, "{column} is off by {most}");
        // The program's own 99 steps per period do not resolve its valves.
        let (times, coarse) = results("closedLoopHeart_singleVessel", VESSEL, column);
        let most = difference(&found, name, &times, &coarse);
        assert!((0.02..0.3).contains(&most), "{column} of the program is off by {most}");
    }
    let volumes = ["heart_RA", "heart_RV", "heart_LA", "heart_LV"].map(|name| &found[&format!("V_{name}")]);
    assert!(volumes.iter().all(|v| v.iter().all(|v| (5.0..300.0).contains(v))), "{volumes:?}");
}

/// A pressure, a valve, a chamber with these values, a valve and a resistance, the second of two periods.
fn beating(chamber: &Value) -> Value {
    let pulse = |t: f64| if t < 0.17 { 5.0 * (1.0 - (std::f64::consts::TAU * t / 0.17).cos()) } else { 0.0 };
    let times: Vec<f64> = (0..=100).map(|k| f64::from(k) / 100.0).collect();
    let pressures: Vec<f64> = times.iter().map(|t| pulse(*t)).collect();
    let valve = |name: &str, up: &str, down: &str| {
        json!({ "type": "ValveTanh", "name": name, "params": { "Rmax": 1e5, "Rmin": 100.0, "Steepness": 100.0,
            "upstream_block": up, "downstream_block": down } })
    };
    json!({
        "simulation_parameters": { "number_of_cardiac_cycles": 2, "number_of_time_pts_per_cardiac_cycle": 101 },
        "boundary_conditions": [
            { "bc_name": "INLET", "bc_type": "PRESSURE", "bc_values": { "t": times, "P": pressures } },
            { "bc_name": "OUTLET", "bc_type": "RESISTANCE", "bc_values": { "Pd": 64.0, "R": 1000.0 } },
        ],
        "vessels": [{ "vessel_id": 0, "vessel_name": "vessel", "zero_d_element_type": "BloodVessel",
            "boundary_conditions": { "outlet": "OUTLET" },
            "zero_d_element_values": { "C": 1e-4, "R_poiseuille": 100.0 } }],
        "valves": [valve("valve0", "INLET", "ventricle"), valve("valve1", "ventricle", "vessel")],
        "chambers": [chamber],
        "initial_condition": { "Vc:ventricle": 96.07, "flow:valve0:ventricle": 0.0 },
    })
}

/// A chamber that beats as half a cosine.
fn twitching() -> Value {
    json!({ "type": "ChamberElastanceInductor", "name": "ventricle", "values": { "Emax": 1.057, "Emin": 0.091,
        "Vrd": 26.1, "Vrs": 18.0, "t_active": 0.2, "t_twitch": 0.3, "Impedance": 0.000_351_787 } })
}

#[test]
fn chambers_between_valves_and_their_start_are_read() {
    let text = beating(&twitching());
    let folder = TempDir::new().unwrap();
    let (path, out) = (folder.path().join("beat.json"), folder.path().join("beat"));
    std::fs::write(&path, text.to_string()).unwrap();
    let said = import(&path, &out);
    assert!(said["notes"].to_string().contains("`flow:valve0:ventricle`"), "{said}");
    assert!(said["notes"].to_string().contains("for the 3 periods under the means of the inputs"), "{said}");
    let found = predicted(&out);
    // At the valves' smallest resistance hardly anything leaves in a beat: the pressure is that of the file's elastance.
    let (time, volume) = (&found["time"], &found["V_ventricle"]);
    let peak = time.iter().position(|t| (t - 0.35).abs() < 1e-9).unwrap();
    let wanted = 1.057 * (volume[peak] - 18.0);
    // The activation is its own largest value at .35.
    assert!(
        (found["p_ventricle_in"][peak] - wanted).abs() < 1e-3 * wanted,
        "{:?}",
        found["p_ventricle_in"][peak]
    );
    assert!(volume[0] < 96.07 && volume[0] > 90.0, "{}", volume[0]);
}

#[test]
fn a_patients_network_of_stenoses_is_imported_in_its_periodic_state() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("patient");
    import(&file("svzerodsolver/vmr-0104_0001.json"), &out);
    let found = predicted(&out);
    let pressure = &found["p_branch0_seg0_in"];
    assert_eq!(pressure.len(), 968);
    // Nine periods from the steady state: the last ends as it began but for what the slowest outlet still has to fill.
    let (first, last) = (pressure[0], pressure[pressure.len() - 1]);
    assert!((first - last).abs() < 0.01 * first, "{first} and {last}");
    // What enters leaves by the five outlets or fills walls: over the period, by the outlets.
    let flow = |name: &str| found[name][1..].iter().sum::<f64>();
    let out: f64 = (0..5).map(|k| flow(&format!("q_RCR_{k}"))).sum();
    assert!((out - flow("q_INFLOW")).abs() < 0.01 * out, "{out} and {}", flow("q_INFLOW"));
    // The same with steps a thousand times as exact; what walls take up is their pressures' rate, and left out.
    let study = folder.path().join("patient/study.toml");
    let text = std::fs::read_to_string(&study).unwrap();
    std::fs::write(&study, text.replace("elements = [", "tolerance = 1e-9\nelements = [")).unwrap();
    let exact = predicted(&folder.path().join("patient"));
    for (name, values) in exact.iter().filter(|(name, _)| !name.ends_with("_wall") && *name != "time") {
        let most = difference(&found, name, &exact["time"], values);
        assert!(most < 2e-4, "{name} is off by {most}");
    }
}

#[test]
fn an_activation_is_read_beside_the_values_of_a_chamber_and_among_them() {
    let folder = TempDir::new().unwrap();
    let run = |name: &str, chamber: &Value| {
        let (path, out) = (folder.path().join(format!("{name}.json")), folder.path().join(name));
        std::fs::write(&path, beating(chamber).to_string()).unwrap();
        import(&path, &out);
        std::fs::read_to_string(out.join("inputs.csv")).unwrap()
    };
    let hill = json!({ "t_shift": 0.2, "tau_1": 0.1, "tau_2": 0.3, "m1": 1.32, "m2": 21.9 });
    let chamber = || json!({ "type": "LinearElastanceChamber", "name": "ventricle", "values": { "Emax": 1.0, "Epass": 0.1, "Vrest": 20.0 } });
    let (mut beside, mut among) = (chamber(), chamber());
    beside["activation_function"] = hill.clone();
    beside["activation_function"]["type"] = json!("two_hill");
    among["values"]["activation_type"] = json!(2);
    for (key, value) in hill.as_object().unwrap() {
        among["values"][key] = value.clone();
    }
    let inputs = run("beside", &beside);
    assert_eq!(inputs, run("among", &among));
    let inputs = table(&inputs);
    let hills = |t: f64| {
        let since = (t - 0.2f64).rem_euclid(1.0);
        let rise = (since / 0.1).powf(1.32);
        rise / (1.0 + rise) / (1.0 + (since / 0.3).powf(21.9))
    };
    let most = (0..100_000).map(|k| hills(f64::from(k) * 1e-5)).fold(0.0, f64::max);
    for (t, a) in inputs["time"].iter().zip(&inputs["ventricle_activation"]) {
        assert!((a - hills(*t) / most).abs() < 1e-6, "{t}: {a}");
    }
    let path = folder.path().join("bad.json");
    among["values"]["activation_type"] = json!(7);
    beside["type"] = json!("RegazzoniChamber");
    let mut soft = twitching();
    soft["values"]["Emax"] = json!(0.05);
    let cases = [
        (among, "activation_type: 7 is not 0, 1 or 2"),
        (beside, "write `PiecewiseCosineChamber`"),
        (soft, "`ventricle` is softer active than at rest"),
    ];
    for (chamber, words) in cases {
        std::fs::write(&path, beating(&chamber).to_string()).unwrap();
        let out = folder.path().join("bad");
        refused(starlings().arg("import").arg(&path).arg("--out").arg(&out), &[words]);
        assert!(!out.exists());
    }
}

#[test]
fn blocks_of_a_heart_that_are_not_understood_are_named() {
    let folder = TempDir::new().unwrap();
    let (path, out) = (folder.path().join("changed.json"), folder.path().join("out"));
    let text = std::fs::read_to_string(file("svzerodsolver/steadyFlow_bifurcationR_R1.json")).unwrap();
    let good: Value = serde_json::from_str(&text).unwrap();
    let cases = [
        (
            "/external_solver_coupling_blocks",
            json!([{ "type": "FLOW" }]),
            "external_solver_coupling_blocks[0] (FLOW)",
        ),
        ("/closed_loop_blocks", json!([{ "closed_loop_type": "Fontan" }]), "a closed loop of type `Fontan`"),
        (
            "/chambers",
            json!([{ "type": "ChamberSphere", "name": "a", "values": {} }]),
            "a chamber of type `ChamberSphere`",
        ),
        (
            "/valves",
            json!([{ "type": "Flap", "name": "a", "params": { "Rmin": 1.0, "Rmax": 2.0 } }]),
            "a valve of type `Flap`",
        ),
        (
            "/boundary_conditions/1",
            json!({ "bc_name": "OUT1", "bc_type": "ClosedLoopRCR", "bc_values":
            { "Rp": 1.0, "C": 1.0, "Rd": 1.0, "closed_loop_outlet": true } }),
            "the file has no closed loop",
        ),
    ];
    for (place, value, words) in cases {
        let mut changed = good.clone();
        let (parent, key) = place.rsplit_once('/').unwrap();
        if let Some(list) = changed.pointer_mut(parent).unwrap().as_array_mut() {
            list[key.parse::<usize>().unwrap()] = value;
        } else {
            changed.pointer_mut(parent).unwrap()[key] = value;
        }
        std::fs::write(&path, changed.to_string()).unwrap();
        refused(starlings().arg("import").arg(&path).arg("--out").arg(&out), &[words]);
        assert!(!out.exists());
    }
}

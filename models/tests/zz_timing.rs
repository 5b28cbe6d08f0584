mod common;
use common::*;
use starlings_models::*;
#[test]
fn timing() {
    for kind in ["windkessel-2", "windkessel-3", "windkessel-4"] {
        let (setup, theta) = setup(kind);
        let times: Vec<f64> = (0..=200).map(|i| 0.005 * i as f64).collect();
        let values = times.iter().map(|t| 400.0 * (9.0 * t).sin().max(0.0)).collect();
        let window = Window { start: 0.0, times: times[1..].to_vec(), observed: vec![f64::NAN; 200], inputs: vec![Signal { times, values }] };
        let m = setup.build().unwrap();
        let j = job(&window, &theta);
        let mut best = std::time::Duration::MAX;
        for _ in 0..2000 {
            let t = std::time::Instant::now();
            let p = m.run(&j).unwrap();
            best = best.min(t.elapsed());
            assert!(p.state[0] > 0.0);
        }
        println!("{kind} {best:?}");
    }
}

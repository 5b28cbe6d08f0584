use starlings_models::Window;

use super::*;

#[test]
fn a_panic_in_the_middle_of_a_decision_ends_the_run_with_an_error() {
    let (sender, _events) = std::sync::mpsc::channel();
    let config = FleetConfig::new(None, "test", CancellationToken::new(), sender);
    let mut fleet = GrpcFleet::listen(config).expect("a fleet");
    let setup = fleet.install(&Setup::default()).expect("it travels");
    fleet.hub.panic_inside();
    let window = Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![], since: vec![] };
    let job = Job { particle: 0, record: 0, window: window.into(), theta: vec![], state: None };
    let error = fleet.run(setup, vec![job]).expect_err("nothing can be decided any more");
    assert!(matches!(&error, FleetError::Stopped(why) if why.contains("panic")), "{error}");
}

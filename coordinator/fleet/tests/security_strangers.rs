//! Callers without the token: they join nothing, learn nothing, and hold nobody up. Each test is one attack.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use fleet_kit::access::{File, Guarded, RUN, holds, raw};
use fleet_kit::{ThreadWorker, assert_exact, await_workers, factory, jobs, square};
use starlings_fleet::access::Secrets;
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::Setup;
use starlings_proto::access::{SERVER_NAME, TOKEN_KEY};
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::{FromWorker, Hello, PROTOCOL, VERSION};
use tokio_stream::StreamExt;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint};
use tonic::{Code, Request, Status};

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// A name that stands in the Hello of a stranger and must not reach the record of the run.
const HOST: &str = "a-host-of-a-stranger";

fn hello() -> generated::FromWorker {
    let (protocol, version, host) = (PROTOCOL, VERSION.to_owned(), HOST.to_owned());
    let hello = Hello { protocol, version, cores: 1, slots: 4, host, pid: 1, nonce: 1, build: None };
    FromWorker::Hello(hello).encode().unwrap()
}

fn endpoint(door: &Guarded) -> Endpoint {
    let tls = ClientTlsConfig::new()
        .ca_certificate(Certificate::from_pem(door.secrets.authority()))
        .domain_name(SERVER_NAME);
    Endpoint::from_shared(format!("https://{}", door.address)).unwrap().tls_config(tls).unwrap()
}

/// Says hello inside TLS with this as the token, and returns how it was refused.
async fn call(channel: Channel, token: Option<&str>) -> Status {
    let said = tokio_stream::iter([hello()]).chain(tokio_stream::pending());
    let mut request = Request::new(said);
    if let Some(token) = token {
        request.metadata_mut().insert(TOKEN_KEY, token.parse().unwrap());
    }
    FleetClient::new(channel).work(request).await.expect_err("it is refused")
}

fn refused(door: &Guarded, token: Option<&str>) -> Status {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async { call(endpoint(door).connect().await.unwrap(), token).await })
}

fn assert_learns_nothing(door: &Guarded, status: &Status) {
    assert_eq!(status.code(), Code::Unauthenticated, "{status:?}");
    let told = format!("{status:?}");
    assert!(!told.contains(RUN) && !told.contains(door.secrets.token().digits()), "{told}");
    for event in door.assert_nobody_joined() {
        assert!(!format!("{event:?}").contains(HOST), "its Hello was read: {event:?}");
    }
}

/// A worker with the access file joins and its answers are right.
fn assert_serves(door: &mut Guarded) {
    let file = File::of(&door.secrets, door.address);
    let worker = file.worker(|_| {});
    await_workers(&door.events, 1);
    let setup = door.fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(20);
    let outcomes = door.fleet.run(setup, jobs.clone()).unwrap();
    assert_exact(&outcomes, &jobs);
    worker.cancel.cancel();
    worker.end().unwrap();
}

/// All that a caller is sent before it is cut off.
fn answer(mut stream: TcpStream) -> Vec<u8> {
    let mut bytes = Vec::new();
    // The end may come as a reset.
    let _ = stream.read_to_end(&mut bytes);
    bytes
}

#[test]
fn a_plain_worker_on_the_tls_port_joins_nothing() {
    let door = Guarded::new();
    let run = factory(|job| Ok(square(job)));
    let worker = ThreadWorker::start_with(door.address, run, |c| c.patience = Duration::from_millis(200));
    let says = worker.end().unwrap_err().to_string();
    assert!(says.contains("--access FILE"), "{says}");
    door.await_refusal("does not speak TLS");
    door.assert_nobody_joined();
}

#[test]
fn a_plain_client_on_the_tls_port_is_sent_no_byte_of_the_run() {
    let door = Guarded::new();
    let mut stream = raw(door.address);
    stream.write_all(PREFACE).unwrap();
    let bytes = answer(stream);
    // One alert of TLS.
    assert!(bytes.len() <= 16 && !holds(&bytes, RUN), "{bytes:?}");
    door.assert_nobody_joined();
}

#[test]
fn a_tls_client_without_a_token_joins_nothing_and_learns_nothing() {
    let mut door = Guarded::new();
    let status = refused(&door, None);
    assert_learns_nothing(&door, &status);
    assert_serves(&mut door);
}

#[test]
fn a_state_is_neither_taken_from_nor_given_to_a_caller_without_the_token() {
    let mut door = Guarded::new();
    let put = |door: &Guarded| {
        let endpoint = endpoint(door);
        async move {
            let mut client = FleetClient::new(endpoint.connect().await.unwrap());
            client.put(tokio_stream::pending::<generated::Chunk>()).await.expect_err("it is refused")
        }
    };
    let get = |door: &Guarded| {
        let endpoint = endpoint(door);
        async move {
            let mut client = FleetClient::new(endpoint.connect().await.unwrap());
            client.get(generated::GetRequest::default()).await.expect_err("it is refused")
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let refused = runtime.block_on(put(&door));
    assert_learns_nothing(&door, &refused);
    let refused = runtime.block_on(get(&door));
    assert_learns_nothing(&door, &refused);
    assert_serves(&mut door);
}

#[test]
fn a_wrong_token_joins_nothing_and_learns_nothing() {
    let door = Guarded::new();
    let digits = door.secrets.token().digits().to_owned();
    let last = if digits.ends_with('0') { "1" } else { "0" };
    for wrong in
        ["", "0", &"0".repeat(64), &digits[..63], &format!("{}{last}", &digits[..63]), &format!("{digits}0")]
    {
        let status = refused(&door, Some(wrong));
        assert_learns_nothing(&door, &status);
    }
}

#[test]
fn the_token_of_another_run_joins_nothing() {
    let door = Guarded::new();
    let other = Secrets::draw().unwrap();
    let status = refused(&door, Some(other.token().digits()));
    assert!(status.message().contains("fresh copy of the access file"), "{status}");
    assert_learns_nothing(&door, &status);
}

#[test]
fn a_hello_before_the_token_is_not_read() {
    let door = Guarded::new();
    // The Hello is on the way before the refusal comes; its host stands in no event, and nobody is refused by version.
    let status = refused(&door, None);
    door.await_refusal("no token");
    assert_learns_nothing(&door, &status);
}

#[test]
fn a_hundred_half_open_handshakes_do_not_hold_up_a_good_worker() {
    let mut door = Guarded::new();
    let silent: Vec<TcpStream> = (0..100).map(|_| raw(door.address)).collect();
    let started = Instant::now();
    assert_serves(&mut door);
    assert!(started.elapsed() < Duration::from_secs(9), "before the silent ones are cut off");
    drop(silent);
}

#[test]
fn more_strangers_than_there_is_room_for_push_each_other_out_and_not_a_good_worker() {
    let mut door = Guarded::new();
    let mut crowd: Vec<TcpStream> = (0..400).map(|_| raw(door.address)).collect();
    assert_serves(&mut door);
    // The first made room for the last.
    assert_eq!(answer(crowd.remove(0)), b"");
    crowd[300].set_nonblocking(true).unwrap();
    let last = crowd[300].read(&mut [0; 1]);
    assert!(last.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock), "the last is there");
}

#[test]
fn a_handshake_that_trickles_in_is_cut_off_after_its_limit() {
    let door = Guarded::new();
    let mut stream = raw(door.address);
    // The head of a greeting of 512 bytes, which then come one by one.
    let mut greeting = vec![0x16, 3, 1, 2, 0, 1, 0, 1, 0xfc, 3, 3];
    greeting.resize(517, 0);
    let started = Instant::now();
    let cut = greeting.iter().find(|byte| {
        std::thread::sleep(Duration::from_millis(250));
        stream.write_all(&[**byte]).is_err()
    });
    assert!(cut.is_some(), "it may go on for ever");
    assert!(started.elapsed() < Duration::from_secs(60));
    door.await_refusal("in time");
}

#[test]
fn a_caller_that_is_silent_after_its_handshake_is_cut_off_after_its_limit() {
    let door = Guarded::new();
    let endpoint = endpoint(&door);
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let _silent = endpoint.connect().await.unwrap();
            std::future::pending::<()>().await;
        });
    });
    door.await_refusal("in time");
    door.assert_nobody_joined();
}

#[test]
fn garbage_on_the_port_breaks_nothing() {
    let mut door = Guarded::new();
    let mut drawn: u64 = 7;
    for length in 1..60 {
        let mut stream = raw(door.address);
        let bytes: Vec<u8> = (0..length * 37)
            .map(|_| {
                drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (drawn >> 33) as u8
            })
            .collect();
        let _ = stream.write_all(&bytes);
    }
    assert_serves(&mut door);
}

/// Memory of this process, bytes.
fn memory() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    text.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

#[test]
fn a_thousand_refused_callers_cost_a_handful_of_events_and_bounded_memory() {
    let mut door = Guarded::new();
    assert_serves(&mut door);
    while door.events.try_recv().is_ok() {}
    let before = memory();
    for i in 0..1000 {
        if i % 10 == 0 {
            refused(&door, Some("no such token"));
        } else {
            let mut stream = raw(door.address);
            stream.write_all(PREFACE).unwrap();
            answer(stream);
        }
    }
    let told = door.assert_nobody_joined();
    let refusals = told.iter().filter(|event| matches!(event, FleetEvent::CallerRefused { .. })).count();
    assert!((2..=9).contains(&refusals) && told.len() < 20, "{told:?}");
    let grown = memory().saturating_sub(before);
    assert!(grown < 32 * 1024 * 1024, "{grown} bytes more");
    assert!(door.fleet.refused().summary().unwrap().contains("callers were refused"));
    assert_serves(&mut door);
}

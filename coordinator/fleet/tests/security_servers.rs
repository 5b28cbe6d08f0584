//! What a worker with an access file tells whom: nothing to anybody but the coordinator of that file. Each test is one attack.
#![allow(clippy::unwrap_used)]

mod fleet_kit;

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fleet_kit::access::{File, Guarded, RUN, holds, raw};
use fleet_kit::{any_port, assert_exact, await_event, await_workers, jobs, listen};
use starlings_fleet::access::Secrets;
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::Setup;
use starlings_worker::WorkerError;

/// Passes bytes on to a server and keeps those that it is sent.
fn recorder(server: std::net::SocketAddr) -> (std::net::SocketAddr, Arc<Mutex<Vec<u8>>>) {
    let listener = TcpListener::bind(any_port()).unwrap();
    let (address, kept) = (listener.local_addr().unwrap(), Arc::<Mutex<Vec<u8>>>::default());
    let recorded = Arc::clone(&kept);
    std::thread::spawn(move || {
        let (near, _) = listener.accept().unwrap();
        let far = TcpStream::connect(server).unwrap();
        let (mut from, mut to) = (near.try_clone().unwrap(), far.try_clone().unwrap());
        std::thread::spawn(move || {
            let _ = std::io::copy(&mut to.try_clone().unwrap(), &mut from);
            let _ = (from.shutdown(Shutdown::Both), to.flush());
        });
        let (mut from, mut to, mut buffer) = (near, far, [0; 4096]);
        while let Ok(n @ 1..) = from.read(&mut buffer) {
            recorded.lock().unwrap().extend(&buffer[..n]);
            if to.write_all(&buffer[..n]).is_err() {
                break;
            }
        }
        let _ = to.shutdown(Shutdown::Both);
    });
    (address, kept)
}

#[test]
fn a_worker_sends_no_token_to_a_coordinator_with_another_certificate() {
    let (own, other) = (Guarded::new(), Guarded::new());
    let (address, sent) = recorder(other.address);
    let file = File::of(&own.secrets, address);
    let says = file.tried().unwrap_err().to_string();
    assert!(says.contains("is not the coordinator of"), "{says}");
    // It never came so far as to be asked for one.
    other.await_refusal("another one");
    assert_eq!(other.fleet.refused().summary().map(|text| text.contains("token")), Some(false));
    assert!(!holds(&sent.lock().unwrap(), own.secrets.token().digits()));
    other.assert_nobody_joined();
}

#[test]
fn a_worker_sends_no_token_to_a_server_that_speaks_no_tls() {
    let listener = TcpListener::bind(any_port()).unwrap();
    let secrets = Secrets::draw().unwrap();
    let file = File::of(&secrets, listener.local_addr().unwrap());
    let server = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut greeting = [0; 4096];
        let n = stream.read(&mut greeting).unwrap();
        // As a plain coordinator answers: settings of HTTP/2.
        let _ = stream.write_all(&[0, 0, 0, 4, 0, 0, 0, 0, 0]);
        let mut bytes = greeting[..n].to_vec();
        let _ = stream.read_to_end(&mut bytes);
        bytes
    });
    let says = file.tried().unwrap_err().to_string();
    assert!(says.contains("is not the coordinator of"), "{says}");
    let bytes = server.join().unwrap();
    assert_eq!(bytes[0], 0x16, "a greeting of TLS");
    assert!(!holds(&bytes, secrets.token().digits()) && !holds(&bytes, RUN));
}

#[test]
fn a_worker_with_an_access_file_does_not_work_for_an_open_coordinator() {
    let (fleet, events, _cancel) = listen(any_port());
    let file = File::of(&Secrets::draw().unwrap(), fleet.address().unwrap());
    assert!(matches!(file.tried(), Err(WorkerError::NoCoordinator { .. })));
    assert!(events.try_iter().all(|event| !matches!(event, FleetEvent::WorkerJoined { .. })));
}

#[test]
fn the_recorded_bytes_of_a_session_open_no_other_one() {
    let mut door = Guarded::new();
    let (address, sent) = recorder(door.address);
    let file = File::of(&door.secrets, address);
    let worker = file.worker(|config| config.once = true);
    await_workers(&door.events, 1);
    let setup = door.fleet.install(&Setup::default()).unwrap();
    let jobs = jobs(8);
    assert_exact(&door.fleet.run(setup, jobs.clone()).unwrap(), &jobs);
    worker.cancel.cancel();
    worker.end().unwrap();
    let bytes = sent.lock().unwrap().clone();
    assert!(bytes.len() > 1000 && !holds(&bytes, door.secrets.token().digits()), "it is encrypted");
    while door.events.try_recv().is_ok() {}
    let mut again = raw(door.address);
    again.write_all(&bytes).unwrap();
    let mut answer = Vec::new();
    let _ = again.read_to_end(&mut answer);
    assert!(!holds(&answer, RUN));
    await_event(&door.events, |event| matches!(event, FleetEvent::CallerRefused { .. }));
    door.assert_nobody_joined();
}

#[test]
fn a_connection_whose_bytes_are_changed_on_the_way_ends_and_joins_nothing() {
    let door = Guarded::new();
    let listener = TcpListener::bind(any_port()).unwrap();
    let (near, server) = (listener.local_addr().unwrap(), door.address);
    std::thread::spawn(move || {
        for from in listener.incoming().map_while(Result::ok) {
            let to = TcpStream::connect(server).unwrap();
            let (mut back, mut answers) = (from.try_clone().unwrap(), to.try_clone().unwrap());
            std::thread::spawn(move || std::io::copy(&mut answers, &mut back));
            let (mut from, mut to, mut buffer, mut seen) = (from, to, [0; 4096], 0);
            while let Ok(n @ 1..) = from.read(&mut buffer) {
                // Behind the greeting: the first encrypted bytes.
                if seen > 0 {
                    buffer[n - 1] ^= 1;
                }
                seen += n;
                if to.write_all(&buffer[..n]).is_err() {
                    break;
                }
            }
        }
    });
    assert!(File::of(&door.secrets, near).tried().is_err());
    await_event(&door.events, |event| matches!(event, FleetEvent::CallerRefused { .. }));
    door.assert_nobody_joined();
}

#[test]
fn a_coordinator_that_moved_is_found_by_its_file_and_an_old_copy_is_refused_with_the_remedy() {
    let first = Guarded::new();
    let (secrets, file) = (first.secrets.clone(), File::of(&first.secrets, first.address));
    let worker = file.worker(|_| {});
    await_workers(&first.events, 1);
    // As when it is killed: its workers are not told.
    let moved = Guarded::with(secrets.clone());
    file.write(&secrets, moved.address);
    worker.cancel.cancel();
    worker.end().unwrap();
    drop(first);
    let worker = file.worker(|_| {});
    await_workers(&moved.events, 1);
    worker.cancel.cancel();
    worker.end().unwrap();
    // New secrets at the same place: the file is replaced, and a worker that waits takes it.
    let other = Guarded::new();
    file.write_with(other.secrets.authority(), secrets.token().clone(), other.address, false);
    let waiting = file.worker(|_| {});
    other.await_refusal("fresh copy of the access file");
    file.write(&other.secrets, other.address);
    await_workers(&other.events, 1);
    waiting.cancel.cancel();
    waiting.end().unwrap();
}

fn refused(file: &File) -> String {
    match file.tried() {
        Err(error @ (WorkerError::Access(_) | WorkerError::Ended { .. })) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_access_file_that_others_can_read_is_refused_before_anything_is_dialled() {
    let door = Guarded::new();
    let file = File::of(&door.secrets, door.address);
    for mode in [0o644, 0o640, 0o660, 0o604] {
        std::fs::set_permissions(&file.path, PermissionsExt::from_mode(mode)).unwrap();
        let says = refused(&file);
        assert!(says.contains(&format!("chmod 600 {}", file.path.display())), "{says}");
    }
    assert_eq!(door.fleet.refused().summary(), None, "nobody called");
}

#[test]
fn a_symbolic_link_to_an_access_file_that_others_can_read_is_refused() {
    let door = Guarded::new();
    let mut file = File::of(&door.secrets, door.address);
    let link = file.folder.path().join("link.json");
    symlink(&file.path, &link).unwrap();
    std::fs::set_permissions(&file.path, PermissionsExt::from_mode(0o644)).unwrap();
    file.path = link;
    assert!(refused(&file).contains("chmod 600"));
}

#[test]
fn an_access_file_of_somebody_else_is_refused_also_through_a_link() {
    let door = Guarded::new();
    let mut file = File::of(&door.secrets, door.address);
    if chown(&file.path, Some(65_534), None).is_err() {
        // Only root gives files away.
        return;
    }
    assert!(refused(&file).contains("belongs to the user with the number 65534"));
    let link = file.folder.path().join("link.json");
    symlink(&file.path, &link).unwrap();
    file.path = link;
    assert!(refused(&file).contains("belongs to the user"));
}

#[test]
fn an_access_file_that_is_missing_malformed_or_of_another_format_is_refused() {
    let door = Guarded::new();
    let file = File::of(&door.secrets, door.address);
    for (text, words) in [
        ("", "is no access file"),
        ("[]", "is no access file"),
        ("{\"starlings_access\": 1}", "is no access file"),
        ("{\"starlings_access\": 99}", "format 99"),
        ("\u{1b}[2J", "is no access file"),
    ] {
        std::fs::write(&file.path, text).unwrap();
        let says = refused(&file);
        assert!(says.contains(words), "{says}");
    }
    std::fs::remove_file(&file.path).unwrap();
    assert!(refused(&file).contains("there is no access file"));
}

#[test]
fn the_access_file_of_a_run_that_ended_is_refused_and_a_worker_that_stays_waits_for_its_limit() {
    let door = Guarded::new();
    let file = File::of(&door.secrets, door.address);
    file.write_with(door.secrets.authority(), door.secrets.token().clone(), door.address, true);
    let says = refused(&file);
    assert!(says.contains("has ended") && says.contains("--stay"), "{says}");
    let report = file.worker(|config| config.stay = Some(Duration::from_millis(300))).end().unwrap();
    assert!(report.reason.contains("--idle"), "{report:?}");
    assert_eq!((report.sessions, door.fleet.refused().summary()), (0, None), "nobody was called");
}

#[test]
fn a_worker_that_stays_serves_one_command_after_another_and_ends_when_it_is_idle() {
    let first = Guarded::new();
    let secrets = first.secrets.clone();
    let file = File::of(&secrets, first.address);
    let worker = file.worker(|config| config.stay = Some(Duration::from_secs(10)));
    let mut door = first;
    for last in [false, false, true] {
        await_workers(&door.events, 1);
        let setup = door.fleet.install(&Setup::default()).unwrap();
        let jobs = jobs(5);
        assert_exact(&door.fleet.run(setup, jobs.clone()).unwrap(), &jobs);
        let ended = door.address;
        file.write_with(secrets.authority(), secrets.token().clone(), ended, true);
        door.fleet.close();
        if last {
            break;
        }
        door = Guarded::with(secrets.clone());
        file.write(&secrets, door.address);
    }
    let report = worker.end().unwrap();
    assert_eq!((report.sessions, report.predictions), (3, 15), "{report:?}");
    assert!(report.reason.contains("--idle"), "{report:?}");
}

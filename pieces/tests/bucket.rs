//! Pieces in a bucket of a real server: what is written is read, what is missing or damaged is told, and only a run's own goes.
#![cfg(feature = "s3")]
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod bucket_kit;

use std::collections::HashSet;
use std::process::Command;

use bucket_kit::Server;
use starlings_pieces::{PieceError, PieceName, PlaceName, hex};

/// Set where this program is the one that speaks with the server, which its environment names.
const PART: &str = "TEST_BUCKET";

/// This program with the environment of the server, in which a client finds it.
fn part(server: &Server, name: &str) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "in_its_environment", "--ignored", "--nocapture"]);
    let ended = command.envs(server.environment()).env(PART, name).output().unwrap();
    let told = [ended.stdout, ended.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(ended.status.success() && told[0].contains("1 passed"), "{}{}", told[0], told[1]);
}

#[test]
#[ignore = "not a test: a part of the others"]
fn in_its_environment() {
    match std::env::var(PART).as_deref() {
        Ok("pieces") => pieces(),
        Ok("nobodys") => nobodys(),
        _ => {}
    }
}

fn name(bytes: &[u8]) -> PieceName {
    *blake3::hash(bytes).as_bytes()
}

fn pieces() {
    let place: PlaceName = "s3://states/of/tests".parse().unwrap();
    assert_eq!(place.to_string(), "s3://states/of/tests");
    let (folder, other) = (place.of_run(&[1; 16]), place.of_run(&[2; 16]));
    let large = vec![7; 262_144];
    for bytes in [&b"one"[..], &large] {
        folder.put(&name(bytes), bytes).unwrap();
        assert_eq!(folder.read(&name(bytes)).unwrap(), bytes);
        folder.check(&name(bytes), bytes.len()).unwrap();
        assert!(matches!(folder.check(&name(bytes), bytes.len() + 1), Err(PieceError::Damaged { .. })));
    }
    // Not in its place before it is put there, and never what another name says.
    drop(folder.stage(b"two").unwrap());
    assert!(matches!(folder.read(&name(b"two")), Err(PieceError::Missing { .. })));
    folder.put(&name(b"two"), b"three").unwrap();
    assert!(matches!(folder.read(&name(b"two")), Err(PieceError::Damaged { .. })));
    // What goes is what nobody needs, of this run alone.
    other.put(&name(b"one"), b"one").unwrap();
    folder.keep_only(&HashSet::from([hex(&name(b"one"))]));
    assert!(matches!(folder.check(&name(&large), large.len()), Err(PieceError::Missing { .. })));
    assert_eq!(folder.read(&name(b"one")).unwrap(), "one");
    folder.remove(&name(b"one"));
    let missing = folder.read(&name(b"one")).unwrap_err().to_string();
    let expected = format!("s3://states/of/tests/starlings-{}/{}", "01".repeat(16), hex(&name(b"one")));
    assert!(missing.contains(&expected), "{missing}");
    assert_eq!(other.read(&name(b"one")).unwrap(), "one");
    drop(other.passing());
    assert!(matches!(place.of_run(&[2; 16]).read(&name(b"one")), Err(PieceError::Missing { .. })));
}

fn nobodys() {
    let place: PlaceName = "s3://nobodys/x".parse().unwrap();
    let refused = place.of_run(&[1; 16]).put(&name(b"one"), b"one").unwrap_err();
    assert!(matches!(refused, PieceError::Bucket { .. }), "{refused}");
    let told = refused.to_string();
    assert!(told.contains("s3://nobodys/x") && told.contains("AWS_ACCESS_KEY_ID"), "{told}");
}

#[test]
fn pieces_of_a_bucket_are_those_of_a_folder() {
    let Some(server) = Server::start() else { return };
    part(&server, "pieces");
    assert_eq!(server.n_object(), 0, "nothing stays");
}

#[test]
fn a_bucket_that_is_not_there_is_named_with_the_remedy() {
    let Some(server) = Server::start() else { return };
    part(&server, "nobodys");
}

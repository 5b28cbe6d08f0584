//! What an access file and its private part are, and what is left alone.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};

use super::*;

fn listening() -> SocketAddr {
    ([127, 0, 0, 1], 7000).into()
}

fn published(path: &Path) -> Access {
    let mut access = Access::at(Some(path)).unwrap();
    access.publish(path, "run", listening(), None).unwrap();
    access
}

#[test]
fn the_next_command_has_the_secrets_of_the_first_and_only_one_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let first = published(&path);
    let token = AccessFile::read(&path).unwrap().token;
    assert!(matches!(Access::at(Some(&path)), Err(AccessFault::InUse(_))));
    drop(first);
    let ended = AccessFile::read(&path).unwrap();
    assert!(ended.ended && ended.token.is(token.digits().as_bytes()));
    let second = published(&path);
    let again = AccessFile::read(&path).unwrap();
    assert!(!again.ended && again.token.is(token.digits().as_bytes()));
    assert_eq!(again.authority, ended.authority);
    drop(second);
    let elsewhere = folder.path().join("other.json");
    drop(published(&elsewhere));
    assert!(!AccessFile::read(&elsewhere).unwrap().token.is(token.digits().as_bytes()), "another run");
}

#[test]
fn both_parts_are_their_owners_alone_and_the_key_is_in_the_private_one_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let _access = published(&path);
    for file in [&path, &private_part(&path)] {
        assert_eq!(fs::metadata(file).unwrap().mode() & 0o777, 0o600, "{}", file.display());
    }
    let key = |file: &Path| fs::read_to_string(file).unwrap().contains("PRIVATE KEY");
    assert!(!key(&path) && key(&private_part(&path)));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else is left");
}

#[test]
fn what_is_no_access_file_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("study.json");
    private_file::write(&path, "{\"precious\": 1}").unwrap();
    assert!(matches!(Access::at(Some(&path)), Err(AccessFault::Standing(_))));
    let own = folder.path().join("access.json");
    drop(published(&own));
    fs::remove_file(private_part(&own)).unwrap();
    let fault = Access::at(Some(&own)).err().unwrap();
    assert!(matches!(fault, AccessFault::Widowed { .. }) && fault.is_input(), "{fault}");
}

#[test]
fn what_came_while_the_command_began_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let mut late = Access::at(Some(&path)).unwrap();
    fs::write(&path, "precious").unwrap();
    let fault = late.publish(&path, "run", listening(), None).unwrap_err();
    assert!(matches!(fault, AccessFault::InUse(_)), "{fault}");
    drop(late);
    assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
    assert!(!private_part(&path).exists(), "nothing is left of a command that published nothing");
    fs::remove_file(&path).unwrap();
    drop(published(&path));
    let mut second = Access::at(Some(&path)).unwrap();
    fs::write(&path, "precious").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
    assert!(matches!(second.publish(&path, "run", listening(), None), Err(AccessFault::Standing(_))));
    drop(second);
    assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
}

#[test]
fn the_name_of_a_private_part_is_none_of_an_access_file() {
    let fault = Access::at(Some(Path::new("pool.key"))).err().unwrap();
    assert!(fault.is_input() && fault.to_string().contains("such as pool.json"), "{fault}");
}

#[test]
fn what_cannot_be_written_is_known_before_it_is_published_and_a_reserved_name_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = folder.path().join("none").join("access.json");
    let fault = Access::at(Some(&nowhere)).unwrap().reserve(&nowhere).unwrap_err();
    assert!(matches!(fault, AccessFault::Unwritable { .. }) && fault.is_input(), "{fault}");
    let path = folder.path().join("access.json");
    let mut first = Access::at(Some(&path)).unwrap();
    first.reserve(&path).unwrap();
    assert!(matches!(Access::at(Some(&path)), Err(AccessFault::InUse(_))));
    drop(first);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_private_part_that_others_can_read_or_that_is_damaged_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    drop(published(&path));
    let private = private_part(&path);
    fs::set_permissions(&private, fs::Permissions::from_mode(0o644)).unwrap();
    let fault = Access::at(Some(&path)).err().unwrap();
    assert!(fault.to_string().contains("chmod 600"), "{fault}");
    private_file::write(&private, "{}").unwrap();
    assert!(matches!(Access::at(Some(&path)), Err(AccessFault::Damaged { .. })));
}

#[test]
fn an_access_file_made_beforehand_lasts_and_its_coordinator_has_the_same_secrets() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("access.json");
    let addresses = vec!["coordinator:7000".to_owned()];
    Access::prepare(&path, "run", addresses.clone()).unwrap();
    let made = AccessFile::read(&path).unwrap();
    assert_eq!((made.ended, &made.addresses), (false, &addresses));
    assert!(matches!(Access::prepare(&path, "run", addresses), Err(AccessFault::Stands(_))));
    let _access = published(&path);
    assert!(AccessFile::read(&path).unwrap().token.is(made.token.digits().as_bytes()));
}

//! Network and disks that belong to a test alone: it starts itself again in namespaces of its own, where it makes links that go down
//! and file systems that become full.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// Set in a test that is in namespaces of its own.
const INSIDE: &str = "CHAOS_INSIDE";

/// Whether this process is in namespaces of its own.
pub(crate) fn inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// Runs this test again in namespaces of its own, where that is allowed; whether it was.
///
/// # Panics
/// When the test fails there.
pub(crate) fn entered(test: &str) -> bool {
    let unshare = || {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "--net"]);
        command
    };
    let made =
        "ip link set lo up && ip link add chaos0 type veth peer name chaos1 && mount -t tmpfs tmpfs /mnt";
    if !unshare().args(["sh", "-c", made]).output().is_ok_and(|tried| tried.status.success()) {
        return false;
    }
    let own = std::env::current_exe().unwrap();
    let script = "ip link set lo up && exec \"$@\"";
    let mut command = unshare();
    command.args(["sh", "-c", script, "sh"]).arg(own).args([
        test,
        "--exact",
        "--include-ignored",
        "--nocapture",
    ]);
    let status = command.env(INSIDE, "1").status().unwrap();
    assert!(status.success(), "{test} failed in namespaces of its own: see above");
    true
}

fn must(program: &str, arguments: &str) {
    let output = Command::new(program).args(arguments.split_whitespace()).output().unwrap();
    assert!(output.status.success(), "{program} {arguments}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A network namespace for one worker, and the link to it.
pub(crate) struct Link {
    number: u32,
    holder: Child,
}

impl Link {
    pub(crate) fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed) % 16_000;
        let mut command = Command::new("unshare");
        command.args(["--net", "sh", "-c", "echo; read end"]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut holder = command.spawn().unwrap();
        // It is in its namespace once it says so.
        let mut said = [0];
        std::io::Read::read_exact(holder.stdout.as_mut().unwrap(), &mut said).unwrap();
        let link = Self { number, holder };
        let (pid, [near, far]) = (link.holder.id(), link.ends());
        must("ip", &format!("link add ch{number} type veth peer name eth0 netns {pid}"));
        must("ip", &format!("addr add {near}/30 dev ch{number}"));
        must("ip", &format!("link set ch{number} up"));
        must("nsenter", &format!("--net --target {pid} ip addr add {far}/30 dev eth0"));
        must("nsenter", &format!("--net --target {pid} ip link set eth0 up"));
        link
    }

    fn ends(&self) -> [String; 2] {
        let (high, low) = (self.number / 64, self.number % 64 * 4);
        [1, 2].map(|end| format!("10.77.{high}.{}", low + end))
    }

    /// The host's address on it.
    pub(crate) fn near(&self) -> String {
        self.ends()[0].clone()
    }

    /// The beginning of a command that runs at its far end.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new("nsenter");
        command.args(["--net", "--target", &self.holder.id().to_string()]);
        command
    }

    /// Takes it down, or up again.
    pub(crate) fn set(&self, is_up: bool) {
        must("ip", &format!("link set ch{} {}", self.number, if is_up { "up" } else { "down" }));
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _ = Command::new("ip").args(["link", "del", &format!("ch{}", self.number)]).status();
        let _ = self.holder.kill();
        let _ = self.holder.wait();
    }
}

/// A file system of some MiB.
pub(crate) struct Disk(PathBuf);

impl Disk {
    pub(crate) fn at(folder: &Path, mib: u32) -> Self {
        std::fs::create_dir_all(folder).unwrap();
        must("mount", &format!("-t tmpfs -o size={mib}m tmpfs {}", folder.display()));
        Self(folder.to_owned())
    }

    fn filler(&self) -> PathBuf {
        self.0.join(".filler")
    }

    /// Leaves no room.
    pub(crate) fn fill(&self) {
        let mut filler = std::fs::File::create(self.filler()).unwrap();
        for piece in [1 << 20, 1 << 12, 1] {
            let zeros = vec![0; piece];
            while filler.write_all(&zeros).is_ok() {}
        }
    }

    /// Has room again.
    pub(crate) fn clear(&self) {
        let _ = std::fs::remove_file(self.filler());
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(&self.0).status();
    }
}

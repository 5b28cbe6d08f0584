//! Small results that do not fit into memory: one file without a name in the scratch folder, and where each stands in it by its key.
//!
//! A result stays until the coordinator has had the time to write it, since what was sent may never have arrived. A disk that is full
//! leaves the file as it was. Next file to read: [`super::shared`].

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::Bound;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::{Duration, Instant};

use starlings_proto::{Bytes, JobKey};

/// What one place of the index takes in memory, about.
const PLACE: usize = 96;

/// Results in a file.
#[derive(Default)]
pub(super) struct HeldFile {
    file: Option<File>,
    /// Where each begins and how long it is.
    places: BTreeMap<JobKey, (u64, usize)>,
    end: u64,
    /// When the last of them was sent.
    sent: Option<Instant>,
}

impl HeldFile {
    /// Bytes in memory.
    pub(super) fn memory(&self) -> usize {
        PLACE * self.places.len()
    }

    /// Bytes on disk.
    pub(super) fn bytes(&self) -> u64 {
        self.end
    }

    /// How many results are in it.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Adds a result, or leaves the file as it was.
    pub(super) fn add(&mut self, scratch: &Path, key: JobKey, ended: &[u8]) -> io::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(tempfile::tempfile_in(scratch)?),
        };
        file.write_all_at(ended, self.end).inspect_err(|_| drop(file.set_len(self.end)))?;
        self.places.insert(key, (self.end, ended.len()));
        self.end += ended.len() as u64;
        self.sent = None;
        Ok(())
    }

    /// A result.
    pub(super) fn read(&self, key: &JobKey) -> io::Result<Option<Bytes>> {
        let (Some(file), Some((begin, length))) = (&self.file, self.places.get(key)) else { return Ok(None) };
        let mut bytes = vec![0; *length];
        file.read_exact_at(&mut bytes, *begin)?;
        Ok(Some(bytes.into()))
    }

    /// The key after one, or the first.
    pub(super) fn key_after(&self, last: Option<&JobKey>) -> Option<JobKey> {
        let after = last.map_or(Bound::Unbounded, Bound::Excluded);
        self.places.range::<JobKey, _>((after, Bound::Unbounded)).map(|(key, _)| *key).next()
    }

    /// All of them have been sent.
    pub(super) fn was_sent(&mut self) {
        self.sent = Some(Instant::now());
    }

    /// They may not have arrived: the connection is gone.
    pub(super) fn was_not_sent(&mut self) {
        self.sent = None;
    }

    /// Drops all of them when they were sent so long ago.
    pub(super) fn expire(&mut self, after: Duration) {
        if self.sent.is_some_and(|sent| sent.elapsed() >= after) {
            *self = Self::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_read_as_often_as_it_is_needed_and_goes_a_while_after_it_was_sent() {
        let mut held = HeldFile::default();
        for n in 0..5 {
            held.add(&std::env::temp_dir(), [n; 32], &vec![n; 10 + usize::from(n)]).unwrap();
        }
        for _ in 0..2 {
            assert_eq!(held.read(&[3; 32]).unwrap().unwrap(), vec![3; 13]);
        }
        assert_eq!(held.read(&[9; 32]).unwrap(), None);
        let after = |n: u8| held.key_after(Some(&[n; 32]));
        assert_eq!((held.key_after(None), after(3), after(4)), (Some([0; 32]), Some([4; 32]), None));
        held.expire(Duration::ZERO);
        held.was_sent();
        held.expire(Duration::from_secs(1000));
        assert_eq!(held.len(), 5);
        held.expire(Duration::ZERO);
        assert_eq!((held.len(), held.bytes()), (0, 0));
    }

    /// This test again, in a process whose files may have 4096 bytes; beyond them a write fails after the part that fits.
    #[test]
    fn a_full_disk_leaves_what_was_held_before() {
        const INSIDE: &str = "STARLINGS_SMALL_FILES";
        if std::env::var_os(INSIDE).is_none() {
            let own = std::env::current_exe().unwrap();
            let mut shell = std::process::Command::new("sh");
            // The signal that goes with the limit ends a process that does not ignore it.
            let script = "trap '' XFSZ; ulimit -f 8; exec \"$0\" --exact \"$1\"";
            shell.args(["-c", script]).arg(own).arg(std::thread::current().name().unwrap()).env(INSIDE, "1");
            let output = shell.output().unwrap();
            let said = String::from_utf8_lossy(&output.stdout);
            assert!(output.status.success() && said.contains("1 passed"), "{said}");
            return;
        }
        let mut held = HeldFile::default();
        let mut add = |n: u8, length| held.add(&std::env::temp_dir(), [n; 32], &vec![n; length]).is_ok();
        assert!(add(1, 3000) && !add(2, 3000) && add(3, 1000) && !add(4, 1000));
        assert_eq!(held.file.as_ref().unwrap().metadata().unwrap().len(), 4000);
        assert_eq!(held.read(&[1; 32]).unwrap().unwrap(), vec![1; 3000]);
        assert_eq!(held.read(&[3; 32]).unwrap().unwrap(), vec![3; 1000]);
        assert_eq!((held.len(), held.bytes()), (2, 4000));
    }
}

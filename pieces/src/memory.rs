//! Memory of one state that processes of a machine see by its descriptor: written once, sealed, then read.
//!
//! Linux's memfd (memfd_create(2), since 3.17). A sealed one can neither be written nor change its length, whoever has its descriptor,
//! so what was checked once stays as it was. Nothing here knows how a descriptor comes to another process.

use std::fs::File;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::FileExt;
use std::sync::Arc;

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, fcntl_get_seals, fstat, ftruncate, memfd_create};

/// That the length stays.
const LENGTH: SealFlags = SealFlags::SHRINK.union(SealFlags::GROW);

/// That the bytes stay too, and the seals.
const ALL: SealFlags = LENGTH.union(SealFlags::WRITE).union(SealFlags::SEAL);

/// Memory of a fixed length under a descriptor.
#[derive(Debug)]
pub struct SharedMemory(pub(crate) Arc<File>);

impl SharedMemory {
    /// Memory of so many bytes, all zero; the system gives each page when it is written.
    ///
    /// # Errors
    /// When the system gives no descriptor.
    pub fn of(bytes: usize) -> io::Result<Self> {
        let file = memfd_create("starlings-state", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        ftruncate(&file, bytes as u64)?;
        fcntl_add_seals(&file, LENGTH)?;
        Ok(Self(Arc::new(file.into())))
    }

    /// The memory of a descriptor that came from another process, which must have this length for ever, and, where `sealed`, its bytes.
    ///
    /// # Errors
    /// When it is something else, or may change.
    pub fn received(descriptor: OwnedFd, bytes: usize, sealed: bool) -> io::Result<Self> {
        let wrong = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
        let wanted = if sealed { ALL - SealFlags::SEAL } else { LENGTH };
        let seals =
            fcntl_get_seals(&descriptor).map_err(|_| wrong("a descriptor of no memory".to_owned()))?;
        if !seals.contains(wanted) {
            return Err(wrong("a descriptor of memory that may change".to_owned()));
        }
        let length = fstat(&descriptor)?.st_size;
        if u64::try_from(length).ok() != Some(bytes as u64) {
            return Err(wrong(format!("{length} bytes of memory where {bytes} belong")));
        }
        Ok(Self(Arc::new(descriptor.into())))
    }

    /// From now on nobody can change it.
    ///
    /// # Errors
    /// When a process has mapped it for writing, or it is sealed already.
    pub fn seal(&self) -> io::Result<()> {
        Ok(fcntl_add_seals(&*self.0, ALL)?)
    }

    /// Writes from this byte on.
    ///
    /// # Errors
    /// When it is sealed or shorter, or the system has no memory.
    pub fn write(&self, bytes: &[u8], at: usize) -> io::Result<()> {
        self.0.write_all_at(bytes, at as u64)
    }

    /// Reads from this byte on.
    ///
    /// # Errors
    /// When it is shorter.
    pub fn read(&self, bytes: &mut [u8], at: usize) -> io::Result<()> {
        self.0.read_exact_at(bytes, at as u64)
    }
}

impl AsFd for SharedMemory {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn twin(memory: &SharedMemory) -> OwnedFd {
        memory.as_fd().try_clone_to_owned().expect("a descriptor")
    }

    #[test]
    fn what_is_sealed_reads_as_it_was_written_and_changes_no_more() {
        let memory = SharedMemory::of(6).expect("room");
        memory.write(b"abcdef", 0).expect("room");
        let other = SharedMemory::received(twin(&memory), 6, false).expect("its length stays");
        other.write(b"XY", 4).expect("it is not sealed");
        memory.seal().expect("nobody has mapped it");
        assert!(other.write(b"Z", 0).is_err() && memory.write(b"Z", 0).is_err());
        let sealed = SharedMemory::received(twin(&memory), 6, true).expect("it is sealed");
        let mut bytes = [0; 6];
        sealed.read(&mut bytes, 0).expect("its length");
        assert_eq!(&bytes, b"abcdXY");
        assert!(sealed.read(&mut bytes, 1).is_err(), "beyond its end");
        assert!(ftruncate(twin(&memory), 3).is_err() && ftruncate(twin(&memory), 9).is_err());
    }

    #[test]
    fn a_descriptor_of_something_else_another_length_or_without_seals_is_refused() {
        let refused = |descriptor: OwnedFd, bytes, sealed| {
            SharedMemory::received(descriptor, bytes, sealed).expect_err("refused").to_string()
        };
        let memory = SharedMemory::of(6).expect("room");
        assert!(refused(twin(&memory), 7, false).contains("6 bytes of memory where 7 belong"));
        assert!(refused(twin(&memory), 6, true).contains("may change"));
        let bare = memfd_create("bare", MemfdFlags::CLOEXEC).expect("a descriptor");
        assert!(refused(bare, 0, false).contains("may change"));
        let file = tempfile::tempfile().expect("a file");
        assert!(refused(file.into(), 0, true).contains("memory"));
        let (end, _other) = io::pipe().expect("a pipe");
        assert!(refused(end.into(), 0, true).contains("no memory"));
    }
}

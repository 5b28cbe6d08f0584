//! Memory that nobody can change any more, read where it stands.
//!
//! The one place of the project that asks the compiler for trust: that bytes behind addresses stay as they are is promised by the system,
//! whose seals it does not know. Next file to read: `memory`.

use std::io;

use memmap2::{Mmap, MmapOptions};
use rustix::fs::{SealFlags, fcntl_get_seals};

use crate::SharedMemory;

/// Bytes of a [`SharedMemory`] that is sealed. They stay when its descriptor is closed, so that a process may see more of them than it may
/// have descriptors.
#[derive(Debug)]
pub struct Sealed(Mmap);

impl SharedMemory {
    /// Its bytes in this process.
    ///
    /// # Errors
    /// When it is not sealed, has no bytes, or the system has no addresses left.
    #[expect(unsafe_code, reason = "a seal is the system's promise, of which the compiler knows nothing")]
    pub fn see(&self) -> io::Result<Sealed> {
        let refused = |text| Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        if !fcntl_get_seals(&*self.0)?.contains(SealFlags::WRITE | SealFlags::SHRINK) {
            return refused("memory that may change");
        }
        let bytes = usize::try_from(self.0.metadata()?.len()).map_err(io::Error::other)?;
        if bytes == 0 {
            return refused("no memory");
        }
        // All pages at once: to be asked for each of them when it is read costs more.
        let mut how = MmapOptions::new();
        how.len(bytes).populate();
        // SAFETY: a mapping is as good as a slice where the file behind it neither changes nor becomes shorter. This one is sealed against
        // both, which was asked of the system above, and a seal is never taken off (fcntl(2), F_ADD_SEALS).
        Ok(Sealed(unsafe { how.map_copy_read_only(&*self.0)? }))
    }
}

impl Sealed {
    /// All of them.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sealed_memory_is_seen_after_its_descriptor_is_gone_and_what_may_change_is_not_seen() {
        let memory = SharedMemory::of(5).expect("room");
        memory.write(b"abcde", 0).expect("it is not sealed");
        assert!(memory.see().expect_err("it may change").to_string().contains("may change"));
        memory.seal().expect("nobody has mapped it");
        let seen = memory.see().expect("it is sealed");
        drop(memory);
        assert_eq!(seen.bytes(), b"abcde");
        let none = SharedMemory::of(0).expect("room");
        none.seal().expect("nobody has mapped it");
        assert!(none.see().is_err());
    }
}

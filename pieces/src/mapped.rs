//! Memory that another process may write at any time, seen by its addresses: copied into and out of, never borrowed.
//!
//! A copy through a mapping costs less than a call that reads or writes. The length of what is mapped is sealed, so no address of it
//! is without a page; a page that the system has not given yet it gives at the first touch. Next file to read: `memory`.

use std::io;
use std::sync::Arc;

use vm_memory::{Bytes, FileOffset, MmapRegion, VolatileMemory};

use crate::SharedMemory;

/// A mapping of all of a [`SharedMemory`].
#[derive(Debug)]
pub struct Mapped(MmapRegion);

impl SharedMemory {
    /// Its addresses in this process. While one process has them it cannot be sealed.
    ///
    /// # Errors
    /// When it is sealed already, has no bytes, or the system has no addresses left.
    pub fn map(&self) -> io::Result<Mapped> {
        let bytes = usize::try_from(self.0.metadata()?.len()).map_err(io::Error::other)?;
        let file = FileOffset::from_arc(Arc::clone(&self.0), 0);
        Ok(Mapped(MmapRegion::from_file(file, bytes).map_err(io::Error::other)?))
    }
}

impl Mapped {
    /// Writes from this byte on.
    ///
    /// # Errors
    /// When it is shorter.
    pub fn write(&self, bytes: &[u8], at: usize) -> io::Result<()> {
        self.0.as_volatile_slice().write_slice(bytes, at).map_err(io::Error::other)
    }

    /// Reads from this byte on.
    ///
    /// # Errors
    /// When it is shorter.
    pub fn read(&self, bytes: &mut [u8], at: usize) -> io::Result<()> {
        self.0.as_volatile_slice().read_slice(bytes, at).map_err(io::Error::other)
    }
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd;

    use super::*;

    #[test]
    fn what_is_written_by_addresses_is_read_by_the_descriptor_and_the_other_way_round() {
        let memory = SharedMemory::of(6).expect("room");
        let twin = memory.as_fd().try_clone_to_owned().expect("a descriptor");
        let other = SharedMemory::received(twin, 6, false).expect("its length stays");
        let (here, there) = (memory.map().expect("addresses"), other.map().expect("addresses"));
        here.write(b"abcdef", 0).expect("its length");
        there.write(b"XY", 4).expect("its length");
        other.write(b"z", 0).expect("it is not sealed");
        let (mut mapped, mut read) = ([0; 6], [0; 6]);
        here.read(&mut mapped, 0).expect("its length");
        memory.read(&mut read, 0).expect("its length");
        assert_eq!((&mapped, &read), (b"zbcdXY", b"zbcdXY"));
        assert!(here.write(b"ab", 5).is_err() && here.read(&mut read, 1).is_err(), "beyond its end");
        assert!(memory.seal().is_err(), "it can be written by its addresses");
        drop((here, there));
        memory.seal().expect("nobody has its addresses");
        assert!(memory.map().is_err(), "it can be written no more");
        assert!(SharedMemory::of(0).expect("room").map().is_err(), "no bytes");
    }
}

//! The protocols between coordinator, workers and external solvers.
//!
//! `proto/fleet.proto` says what travels between coordinator and worker, `proto/solver.proto` between a worker and a solver
//! outside, in which unit and shape. [`generated`] and [`generated_solver`] are generated from them; [`convert`] alone looks inside
//! and checks and translates them. [`access`] is the file by which both sides know each other, [`socket`] the connection of workers
//! that one process started, [`descriptors`] what is passed beside it, [`driven`] the network of a process, driven by whoever waits
//! for it, [`batch`] how the system knows a thread that computes. No scheduling here. Next file to read: [`convert`].

pub mod access;
pub mod adapters;
pub mod batch;
mod codec;
pub mod convert;
pub mod descriptors;
pub mod driven;
pub mod host;
pub mod private_file;
mod program;
pub mod socket;
pub mod spent;
pub mod text;
pub mod words;

pub use bytes::Bytes;
pub(crate) use codec::Codec;
pub use convert::{
    Block, FromWorker, HeldRun, Hello, InKey, JobEncoder, JobKey, JobKeys, Lease, LeaseOutcome,
    ProtocolError, ReceivedWindows, SentWindows, SetupId, State, StateId, StateNaming, ToWorker, Welcome,
    decode_setup, digest, encode_setup, job_key,
};

pub use program::{BUILD, build_of_file, own_build};

/// Number of the protocol; coordinator and worker must have the same.
pub const PROTOCOL: u32 = 7;

/// Largest state that travels inside a job or a prediction, bytes; a larger one travels by itself, under a name.
pub const MAX_INLINE_STATE: usize = 256 * 1024;

/// Largest state that either side takes, bytes.
pub const MAX_STATE: usize = 16 * 1024 * 1024 * 1024;

/// Largest message either side accepts, bytes.
pub const MAX_MESSAGE: usize = 16 * 1024 * 1024;

/// HTTP/2 frame size either side accepts, bytes: a piece of a state is one frame. The default of 16 KiB halves the transport rate of large
/// windows.
pub const FRAME_SIZE: u32 = 1024 * 1024;

/// Largest number of slots of one worker: each is a thread.
pub const MAX_SLOTS: usize = 4096;

/// What a worker is told to connect to where its standard input is the connection: one of a pair of sockets, of which the process
/// that started it holds the other.
pub const INHERITED: &str = "stdin";

/// Environment variable by which a supervisor tells a solver that its standard input is a lifeline: a pipe that closes when the
/// supervisor ends, however it ends.
pub const LIFELINE: &str = "STARLINGS_LIFELINE";

/// Package version sent in [`Hello`]; unequal versions are refused, since they may not give the same bits.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Types and service stubs generated from `proto/fleet.proto`.
#[allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic, rust_2018_idioms)]
pub mod generated {
    tonic::include_proto!("starlings.fleet.v1");
}

/// Types and service stubs generated from `proto/solver.proto`.
#[allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic, rust_2018_idioms)]
pub mod generated_solver {
    tonic::include_proto!("starlings.solver.v1");
}

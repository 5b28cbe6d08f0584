//! A run while it runs: a page that follows it, and the same numbers for a terminal.
//!
//! It reads the store of the run and what the fleet tells, and nothing else; nobody reads anything back from it. A view is made when
//! somebody looks, ten times a second at most, once for all who look: who reads slowly gets the next one later, and nothing waits for
//! him. Next files to read: [`view`] for what is shown, [`told`] for what is heard, [`course`] for what is read, [`mod@serve`].

pub mod course;
pub mod folder;
pub mod pace;
mod page;
mod routes;
pub mod serve;
pub mod told;
pub mod view;

pub use course::Course;
pub use folder::Watched;
pub use pace::{Pace, Reach};
pub use serve::{Live, LivePage};
pub use told::Told;
pub use view::{Counted, Head, Standing, State, View};

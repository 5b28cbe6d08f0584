//! What a fleet does, for a Prometheus that scrapes it and for engines that ask whether it is well.
//!
//! A page is made when somebody asks for it, of what the fleet has counted anyway. It holds numbers and nothing of a study, so it has
//! no lock but its address: loopback, unless another one is named. Next files to read: [`page`], [`server`].

pub mod page;
mod routes;
mod server;

pub use page::Source;
pub use routes::routes;
pub use server::{Address, ServeError, Server};

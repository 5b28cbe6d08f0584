//! The command by which a run is continued, and what that command accepts.
//!
//! Next file to read: [`super::resume`].

/// How a run is continued.
#[derive(Clone, Copy, Debug, Default)]
pub struct Call<'a> {
    /// The command line.
    pub command: &'a str,
    /// When it was given, as text.
    pub started: &'a str,
    /// Go on with another build of this program or another solver than those that began.
    pub other_build: bool,
}

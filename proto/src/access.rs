//! The access file: what a worker needs to find its coordinator, to know it again, and to be known by it.
//!
//! The coordinator writes it when it listens, and again when it ends; a worker reads it whenever it dials. Whoever has it can join
//! the run. Next file to read: [`crate::private_file`].

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::private_file::{self, PrivateFileError};

/// The name to which a coordinator's certificate is made out, wherever the coordinator runs: what proves it is the authority in
/// the access file, which signed nothing else.
pub const SERVER_NAME: &str = "coordinator.starlings";

/// The metadata of every call that holds the token.
pub const TOKEN_KEY: &str = "starlings-token";

/// Number of the format.
const FORMAT: u64 = 1;

/// Key of that number, by which an access file is told from another one.
const FORMAT_KEY: &str = "starlings_access";

/// What proves a worker: 256 random bits as hexadecimal digits.
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Token(String);

impl Token {
    /// The token of these bits.
    pub fn of(bits: &[u8; 32]) -> Self {
        Self(blake3::Hash::from_bytes(*bits).to_hex().to_string())
    }

    /// The digits, for the metadata of a call.
    pub fn digits(&self) -> &str {
        &self.0
    }

    /// Whether this is what was offered, in a time that does not tell how much of it is.
    pub fn is(&self, offered: &[u8]) -> bool {
        // The comparison of hashes takes the same time for any two.
        blake3::hash(self.0.as_bytes()) == blake3::hash(offered)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(secret)")
    }
}

impl TryFrom<String> for Token {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let is_whole = text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        if is_whole { Ok(Self(text)) } else { Err("a token has 64 hexadecimal digits") }
    }
}

impl From<Token> for String {
    fn from(token: Token) -> Self {
        token.0
    }
}

/// What an access file holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AccessFile {
    /// Number of the format.
    #[serde(rename = "starlings_access")]
    format: u64,
    /// Name of the run.
    pub run: String,
    /// Whether the run has ended, so that nobody listens.
    pub ended: bool,
    /// Where the coordinator listens, `host:port`, the likeliest first.
    pub addresses: Vec<String>,
    /// The authority that signed the coordinator's certificate, PEM.
    pub authority: String,
    /// What proves a worker.
    pub token: Token,
}

/// Why an access file is of no use.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// There is none.
    #[error(
        "there is no access file {}: the coordinator writes it when it starts to listen, and says where (`starlings run STUDY \
         --listen ADDR`)",
        .0.display()
    )]
    Missing(PathBuf),
    /// It cannot be read, or others could.
    #[error("the access file is not taken: {0}")]
    Private(#[from] PrivateFileError),
    /// It is no access file.
    #[error(
        "{} is no access file ({reason}): give the file whose name the coordinator prints when it starts to listen",
        path.display()
    )]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// It is of another version of this program.
    #[error(
        "{} is an access file of format {found}, this program reads {FORMAT}: start the same version on both sides",
        path.display()
    )]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// Its number.
        found: u64,
    },
}

impl AccessFile {
    /// The access file of a run that listens.
    pub fn new(run: &str, addresses: Vec<String>, authority: &str, token: Token) -> Self {
        let (run, authority) = (run.to_owned(), authority.to_owned());
        Self { format: FORMAT, run, ended: false, addresses, authority, token }
    }

    /// Reads one.
    ///
    /// # Errors
    /// When there is none, it is none, or somebody else could have read or made it.
    pub fn read(path: &Path) -> Result<Self, AccessError> {
        let text = private_file::read(path).map_err(|error| match error {
            PrivateFileError::Unreadable { path, source } if source.kind() == io::ErrorKind::NotFound => {
                AccessError::Missing(path)
            }
            error => error.into(),
        })?;
        Self::from_text(path, &text)
    }

    /// The content of one.
    ///
    /// # Errors
    /// When it is none, of which `path` is named.
    pub fn from_text(path: &Path, text: &str) -> Result<Self, AccessError> {
        let malformed = |reason: String| AccessError::Malformed { path: path.to_owned(), reason };
        let value: Value = serde_json::from_str(text).map_err(|error| malformed(error.to_string()))?;
        match value.get(FORMAT_KEY).and_then(Value::as_u64) {
            None => return Err(malformed(format!("it has no number `{FORMAT_KEY}`"))),
            Some(FORMAT) => {}
            Some(found) => return Err(AccessError::OtherFormat { path: path.to_owned(), found }),
        }
        let read: Self = serde_json::from_value(value).map_err(|error| malformed(error.to_string()))?;
        if read.addresses.is_empty() { Err(malformed("it names no address".to_owned())) } else { Ok(read) }
    }

    /// Writes it for this user alone, so that no reader sees half of one.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        private_file::write(path, &self.text()?)
    }

    /// The same where nothing stands yet.
    ///
    /// # Errors
    /// When something stands there, or it cannot be written.
    pub fn write_new(&self, path: &Path) -> io::Result<()> {
        private_file::write_new(path, &self.text()?)
    }

    fn text(&self) -> io::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn token() -> Token {
        Token::of(&std::array::from_fn(|i| i as u8))
    }

    #[test]
    fn a_token_is_itself_and_nothing_else_and_is_never_shown() {
        let token = token();
        assert!(token.is(token.digits().as_bytes()));
        for other in [&token.digits()[1..], "", &"0".repeat(64), &token.digits().to_uppercase()] {
            assert!(!token.is(other.as_bytes()), "{other}");
        }
        assert!(!format!("{token:?}").contains(&token.digits()[..8]));
        let file = AccessFile::new("run", vec!["a:1".to_owned()], "PEM", token.clone());
        assert!(!format!("{file:?}").contains(&token.digits()[..8]));
    }

    #[test]
    fn an_access_file_arrives_whole_and_what_is_none_is_refused_with_its_reason() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        let says = |text: &str| {
            private_file::write(&path, text).unwrap();
            AccessFile::read(&path).unwrap_err().to_string()
        };
        assert!(says("").contains("is no access file"));
        assert!(says("{\"run\": \"a\"}").contains("no number `starlings_access`"));
        assert!(says("{\"starlings_access\": 2}").contains("format 2, this program reads 1"));
        assert!(says("{\"starlings_access\": 1, \"run\": \"a\"}").contains("missing field"));
        let mut file = AccessFile::new("run", vec![], "PEM", token());
        assert!(says(&serde_json::to_string(&file).unwrap()).contains("names no address"));
        let cut = serde_json::to_string(&file).unwrap().replace(token().digits(), "00");
        assert!(says(&cut).contains("64 hexadecimal digits"));
        file.addresses.push("node:7000".to_owned());
        file.write(&path).unwrap();
        let back = AccessFile::read(&path).unwrap();
        assert_eq!((back.run.as_str(), back.ended, &back.addresses), ("run", false, &file.addresses));
        assert!(back.token.is(file.token.digits().as_bytes()));
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(AccessFile::read(&path), Err(AccessError::Missing(_))));
    }
}

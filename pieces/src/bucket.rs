//! Pieces as objects of a bucket that speaks the protocol of Amazon's S3.
//!
//! Credentials, region and the address of a service that is not Amazon's come from the environment, under the names that all programs
//! use (`AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_SESSION_TOKEN`, `AWS_REGION`, `AWS_ENDPOINT`, `AWS_ALLOW_HTTP`). A put takes the place of
//! an object as a whole, so nobody sees a part of one. Requests are made on a thread of their own; whoever asks waits for the answer.

use std::collections::HashSet;
use std::path::{Path as FilePath, PathBuf};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::Duration;

use bytes::Bytes;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path;
use object_store::{ObjectStore as _, ObjectStoreExt as _, RetryConfig};
use tokio::runtime::Handle;
use tokio_stream::StreamExt as _;

use crate::folder::{Staged, Storage};
use crate::{PieceError, PieceName, hex};

/// How a bucket is named: `s3://BUCKET/PREFIX`.
pub(crate) const SCHEME: &str = "s3";

/// What is tried with a piece that is put, for messages.
const WRITE: &str = "write into";

/// How often a request is made again that a service did not answer, and for how long.
const RETRIES: (usize, Duration) = (5, Duration::from_secs(30));

/// A prefix within a bucket.
#[derive(Clone)]
pub(crate) struct Bucket {
    client: Arc<AmazonS3>,
    prefix: Path,
    url: PathBuf,
}

impl std::fmt::Debug for Bucket {
    // Nothing else: the client knows secrets.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Bucket({})", self.url.display())
    }
}

impl PartialEq for Bucket {
    fn eq(&self, other: &Self) -> bool {
        self.url == other.url
    }
}

impl Eq for Bucket {}

impl Bucket {
    /// The one of what stands after `s3://`.
    pub(crate) fn named(rest: &str) -> Result<Self, String> {
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let is_name = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        if bucket.is_empty() || !bucket.chars().all(is_name) || prefix.contains(['?', '#']) {
            return Err(format!("expected {SCHEME}://BUCKET/PREFIX, such as {SCHEME}://states/study"));
        }
        // The one that the rest of the program has; where one is chosen already, it is the same.
        let _ = tokio_rustls::rustls::crypto::ring::default_provider().install_default();
        let retry =
            RetryConfig { max_retries: RETRIES.0, retry_timeout: RETRIES.1, ..RetryConfig::default() };
        let client = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry).build();
        let client =
            client.map_err(|error| format!("the environment does not say how to reach it: {error}"))?;
        let prefix = Path::from(prefix.trim_matches('/'));
        Ok(Self { client: Arc::new(client), url: url(bucket, &prefix), prefix })
    }

    /// One below it.
    pub(crate) fn below(&self, name: &str) -> Self {
        Self {
            client: Arc::clone(&self.client),
            prefix: self.prefix.clone().join(name),
            url: self.url.join(name),
        }
    }

    pub(crate) fn url(&self) -> &FilePath {
        &self.url
    }

    fn failed(&self, what: &'static str) -> impl Fn(String) -> PieceError {
        let url = self.url.clone();
        move |says| PieceError::Bucket { what, url: url.clone(), says }
    }

    /// The answer to a request; the inner error is that of the service.
    fn answer<T: Send + 'static>(
        &self,
        what: &'static str,
        request: impl Future<Output = object_store::Result<T>> + Send + 'static,
    ) -> Result<object_store::Result<T>, PieceError> {
        let network = network().map_err(|error| self.failed(what)(error.to_string()))?;
        let (answer, answered) = mpsc::channel();
        network.spawn(async move { answer.send(request.await) });
        answered.recv().map_err(|_| self.failed(what)("its thread ended".to_owned()))
    }

    /// The answer to a request for a piece, which may be missing.
    fn sought<T: Send + 'static>(
        &self,
        what: &'static str,
        name: &PieceName,
        request: impl Future<Output = object_store::Result<T>> + Send + 'static,
    ) -> Result<T, PieceError> {
        self.answer(what, request)?.map_err(|error| match error {
            object_store::Error::NotFound { .. } => {
                PieceError::Missing { piece: hex(name), path: self.url.join(hex(name)) }
            }
            error => self.failed(what)(error.to_string()),
        })
    }

    fn object(&self, name: &PieceName) -> Path {
        self.prefix.clone().join(hex(name))
    }

    /// Removes objects of the prefix.
    fn remove_where(&self, is_it: impl Fn(&str) -> bool + Send + 'static) {
        let (client, prefix) = (Arc::clone(&self.client), self.prefix.clone());
        let removed = self.answer("remove pieces from", async move {
            let mut listed = client.list(Some(&prefix));
            let mut gone = Vec::new();
            while let Some(object) = listed.next().await {
                let location = object?.location;
                if location.filename().is_some_and(&is_it) {
                    gone.push(Ok(location));
                }
            }
            let mut removing = client.delete_stream(Box::pin(tokio_stream::iter(gone)));
            while let Some(removed) = removing.next().await {
                removed?;
            }
            Ok(())
        });
        // What stays costs space, and is named by nobody.
        drop(removed);
    }
}

fn url(bucket: &str, prefix: &Path) -> PathBuf {
    let prefix: &str = prefix.as_ref();
    PathBuf::from(if prefix.is_empty() {
        format!("{SCHEME}://{bucket}")
    } else {
        format!("{SCHEME}://{bucket}/{prefix}")
    })
}

/// Where requests are made, for as long as the process lives.
fn network() -> std::io::Result<&'static Handle> {
    static NETWORK: OnceLock<Handle> = OnceLock::new();
    if let Some(handle) = NETWORK.get() {
        return Ok(handle);
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let handle = runtime.handle().clone();
    // Of two that are made at once the other one ends.
    if NETWORK.set(handle).is_ok() {
        let drive = move || runtime.block_on(std::future::pending::<()>());
        std::thread::Builder::new().name("bucket".to_owned()).spawn(drive)?;
    }
    NETWORK.get().ok_or_else(|| std::io::Error::other("no thread for requests"))
}

impl Storage for Bucket {
    fn path(&self) -> &FilePath {
        &self.url
    }

    fn stage(&self, bytes: &[u8]) -> Result<Staged, PieceError> {
        Ok(Staged::Object(Bytes::copy_from_slice(bytes)))
    }

    fn place(&self, written: Staged, name: &PieceName) -> Result<(), PieceError> {
        let bytes = match written {
            Staged::Object(bytes) => bytes,
            Staged::File(file) => {
                let read = std::fs::read(&file).map(Bytes::from);
                read.map_err(|error| self.failed(WRITE)(error.to_string()))?
            }
        };
        let (client, object) = (Arc::clone(&self.client), self.object(name));
        let put = self.answer(WRITE, async move { client.put(&object, bytes.into()).await.map(drop) })?;
        put.map_err(|error| self.failed(WRITE)(error.to_string()))
    }

    fn fetch(&self, name: &PieceName) -> Result<Bytes, PieceError> {
        let (client, object) = (Arc::clone(&self.client), self.object(name));
        self.sought("read from", name, async move { client.get(&object).await?.bytes().await })
    }

    fn length(&self, name: &PieceName) -> Result<u64, PieceError> {
        let (client, object) = (Arc::clone(&self.client), self.object(name));
        self.sought("look into", name, async move { Ok(client.head(&object).await?.size) })
    }

    fn remove(&self, name: &PieceName) {
        let (client, object) = (Arc::clone(&self.client), self.object(name));
        drop(self.answer("remove pieces from", async move { client.delete(&object).await }));
    }

    fn keep_only(&self, names: &HashSet<String>) {
        let names = names.clone();
        self.remove_where(move |name| !names.contains(name));
    }

    fn clear(&self) {
        self.remove_where(|_| true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_is_named_by_its_url_and_what_is_none_is_refused() {
        for (rest, url) in [("states", "s3://states"), ("a.b-c/x/y/", "s3://a.b-c/x/y")] {
            assert_eq!(Bucket::named(rest).expect("a bucket").url(), FilePath::new(url));
        }
        let run = Bucket::named("states/x").expect("a bucket").below("run");
        assert_eq!(
            (run.url().to_str(), run.object(&[0; 32]).as_ref()),
            (Some("s3://states/x/run"), format!("x/run/{}", "00".repeat(32)).as_str())
        );
        for wrong in ["", "/x", "a b/x", "states/x?y", "user:word@host/x"] {
            let refused = Bucket::named(wrong).expect_err("no bucket");
            assert!(refused.contains("expected s3://BUCKET/PREFIX"), "{refused}");
        }
    }
}

//! The way to the coordinator: dialled with an access file, dialled plainly, or inherited.
//!
//! With an access file every attempt reads the file again, so that a coordinator that moved or was started again is found; the
//! token is sent inside TLS, after the coordinator has shown the certificate that the file's authority signed. Next file to read:
//! [`super::dial`].

use std::error::Error;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioIo;
use starlings_proto::access::{AccessError, AccessFile, SERVER_NAME, TOKEN_KEY, Token};
use starlings_proto::descriptors::{self, DescriptorReceiver};
use starlings_proto::socket::SocketEnd;
use starlings_proto::words::causes;
use starlings_proto::{FRAME_SIZE, INHERITED};
use tokio::io::BufReader;
use tokio::net::TcpStream;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Uri};
use tonic::{Request, Status};
use tower::{ServiceExt as _, service_fn};

use crate::{WorkerConfig, WorkerError};

/// Longest time for one attempt.
pub(crate) const ATTEMPT: Duration = Duration::from_secs(10);

/// Time between HTTP/2 keep-alive pings: far above the silence at which either side acts, since it is only for connections that
/// neither side would otherwise notice to be dead.
const KEEP_ALIVE: Duration = Duration::from_secs(60);

/// How long such a ping may stay unanswered.
const KEEP_ALIVE_PATIENCE: Duration = Duration::from_secs(30);

/// HTTP/2 windows per stream and per connection, bytes.
const WINDOWS: (u32, u32) = (4 * 1024 * 1024, 16 * 1024 * 1024);

/// Bytes that are read ahead of TLS, which asks the system for a quarter of a record at a time.
const AHEAD: usize = 64 * 1024;

/// A connection whose every call carries the proof of this worker.
pub(crate) type Proven = InterceptedService<Channel, Proof>;

/// The token, where the coordinator asks for one.
#[derive(Clone)]
pub(crate) struct Proof(Option<MetadataValue<Ascii>>);

impl Proof {
    fn of(token: &Token) -> Self {
        let value = MetadataValue::try_from(token.digits()).ok().map(|mut value| {
            // Logs do not show it.
            value.set_sensitive(true);
            value
        });
        Self(value)
    }
}

impl Interceptor for Proof {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(token) = &self.0 {
            request.metadata_mut().insert(TOKEN_KEY, token.clone());
        }
        Ok(request)
    }
}

/// Why there is no connection.
pub(crate) enum NoWay {
    /// The access file says that the run has ended.
    Ended(String),
    /// Anything else, which may be over at the next attempt.
    Failed(String),
}

/// The way to the coordinator.
pub(crate) enum Way {
    /// Dialled plainly, as often as it is needed.
    Plain { address: String, endpoint: Endpoint },
    /// Dialled as an access file says, which is read every time.
    Access {
        file: PathBuf,
        /// Where to dial instead of the file's addresses.
        address: Option<String>,
        once: bool,
        attempts: AtomicUsize,
    },
    /// The standard input, which is there already, and once; with the descriptors that come beside it.
    Inherited(Endpoint, UnixStream, Option<Arc<DescriptorReceiver>>),
}

impl Way {
    /// The way that the worker was told.
    ///
    /// # Errors
    /// When it was told no address, its access file is of no use, or its standard input is no socket where that is the way.
    pub(crate) fn of(config: &WorkerConfig) -> Result<Self, WorkerError> {
        let address = config.connect.clone();
        if let Some(file) = &config.access {
            let address = Some(address).filter(|address| !address.is_empty());
            if let Some(address) = &address {
                uri(address, "https")?;
            }
            match AccessFile::read(file) {
                Ok(read) if read.ended && config.stay.is_none() => {
                    return Err(WorkerError::Ended { file: file.clone(), run: read.run });
                }
                // A coordinator may write it later.
                Err(AccessError::Missing(_)) if config.stay.is_some() => {}
                read => drop(read?),
            }
            let (file, once) = (file.clone(), config.once);
            return Ok(Self::Access { file, address, once, attempts: AtomicUsize::new(0) });
        }
        if address != INHERITED {
            let endpoint = Endpoint::from(uri(&address, "http")?);
            return Ok(Self::Plain { endpoint: dialled(endpoint, config.once), address });
        }
        let own = std::io::stdin().as_fd().try_clone_to_owned().map_err(WorkerError::NoSocket)?;
        let socket = UnixStream::from(own);
        socket.peer_addr().map_err(WorkerError::NoSocket)?;
        let descriptors = descriptors::offered(&socket).map_err(WorkerError::NoSocket)?;
        // The address is never resolved.
        Ok(Self::Inherited(with_windows(Endpoint::from_static("http://coordinator")), socket, descriptors))
    }

    /// The descriptors that come beside the connection.
    pub(crate) fn descriptors(&self) -> Option<Arc<DescriptorReceiver>> {
        if let Self::Inherited(_, _, descriptors) = self { descriptors.clone() } else { None }
    }

    /// Whether what travels on it arrives as it was sent: inside TLS, which proves every record, or inside this machine.
    pub(crate) fn is_safe(&self) -> bool {
        !matches!(self, Self::Plain { .. })
    }

    pub(crate) fn is_inherited(&self) -> bool {
        matches!(self, Self::Inherited(..))
    }

    /// Where it leads, for messages.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Plain { address, .. } | Self::Access { address: Some(address), .. } => address.clone(),
            Self::Access { file, .. } => match AccessFile::read(file) {
                Ok(read) => format!("{} (as {} says)", read.addresses.join(" or "), file.display()),
                Err(_) => format!("the address in {}", file.display()),
            },
            Self::Inherited(..) => "the standard input".to_owned(),
        }
    }

    /// What else may be at fault when a connection stands and the coordinator does not speak on it, as the end of a sentence.
    pub(crate) fn hint(&self) -> &'static str {
        match self {
            Self::Plain { .. } => {
                "; a coordinator that was started without --insecure takes workers with --access FILE"
            }
            Self::Access { .. } | Self::Inherited(..) => "",
        }
    }

    /// One attempt to connect, and where it led.
    pub(crate) async fn open(&self) -> Result<(Proven, String), NoWay> {
        let failed = |error: tonic::transport::Error| NoWay::Failed(causes(&error));
        let channel = match self {
            Self::Plain { endpoint, .. } => endpoint.connect().await.map_err(failed)?,
            Self::Access { file, address, once, attempts } => {
                let attempt = attempts.fetch_add(1, Ordering::Relaxed);
                return with_access(file, address.as_deref(), *once, attempt).await;
            }
            Self::Inherited(endpoint, socket, _) => {
                let socket = socket.try_clone().and_then(SocketEnd::new);
                let mut socket = Some(socket);
                let connect = move |_: Uri| {
                    let taken =
                        || Err(std::io::Error::other("the standard input was the connection already"));
                    std::future::ready(socket.take().unwrap_or_else(taken).map(TokioIo::new))
                };
                endpoint.connect_with_connector(service_fn(connect)).await.map_err(failed)?
            }
        };
        Ok((InterceptedService::new(channel, Proof(None)), self.name()))
    }
}

/// Connects as an access file says now, and says where; with several addresses, to another one at every attempt.
async fn with_access(
    file: &std::path::Path,
    address: Option<&str>,
    once: bool,
    attempt: usize,
) -> Result<(Proven, String), NoWay> {
    let failed = |text: String| NoWay::Failed(text);
    let access = AccessFile::read(file).map_err(|error| failed(error.to_string()))?;
    if access.ended {
        let text = format!("the run `{}` of {} has ended", access.run, file.display());
        return Err(NoWay::Ended(text));
    }
    let told = access.addresses.get(attempt % access.addresses.len().max(1)).map(String::as_str);
    let address = address.or(told).unwrap_or_default();
    let uri = uri(address, "https").map_err(|error| failed(error.to_string()))?;
    let tls = ClientTlsConfig::new()
        .ca_certificate(Certificate::from_pem(&access.authority))
        .domain_name(SERVER_NAME)
        .timeout(ATTEMPT);
    let endpoint = dialled(Endpoint::from(uri), once).tls_config(tls);
    let endpoint = endpoint.map_err(|error| failed(format!("{}: {}", file.display(), causes(&error))))?;
    let ahead = |tcp: TokioIo<TcpStream>| TokioIo::new(BufReader::with_capacity(AHEAD, tcp.into_inner()));
    let connector = tcp().map_response(ahead);
    let connected = endpoint.connect_with_connector(connector).await.map_err(|error| {
        let words = causes(&error);
        failed(if is_other_server(&error) {
            format!("whoever answers at {address} is not the coordinator of {}: {words}", file.display())
        } else {
            format!("{address}: {words}")
        })
    })?;
    Ok((InterceptedService::new(connected, Proof::of(&access.token)), address.to_owned()))
}

/// Whether the other side answered and failed the handshake.
fn is_other_server(error: &tonic::transport::Error) -> bool {
    let mut next: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(error) = next {
        let inner = error.downcast_ref::<std::io::Error>();
        if inner.is_some_and(|inner| inner.kind() == std::io::ErrorKind::InvalidData) {
            return true;
        }
        next = error.source();
    }
    false
}

/// Whether this is an address that could be dialled.
///
/// # Errors
/// When it is none.
pub fn check_address(address: &str) -> Result<(), WorkerError> {
    uri(address, "https").map(drop)
}

fn uri(address: &str, scheme: &str) -> Result<Uri, WorkerError> {
    let bad = || WorkerError::BadAddress { address: address.to_owned() };
    let bare = address.strip_prefix(&format!("{scheme}://")).unwrap_or(address);
    let port =
        bare.rsplit_once(':').and_then(|(host, port)| port.parse::<u16>().ok().filter(|_| !host.is_empty()));
    port.ok_or_else(bad)?;
    format!("{scheme}://{bare}").parse().map_err(|_| bad())
}

fn with_windows(endpoint: Endpoint) -> Endpoint {
    endpoint
        .initial_stream_window_size(WINDOWS.0)
        .initial_connection_window_size(WINDOWS.1)
        .max_frame_size(FRAME_SIZE)
}

/// What dials, as [`dialled`] says it for connections that are not read ahead.
fn tcp() -> HttpConnector {
    let mut tcp = HttpConnector::new();
    tcp.enforce_http(false);
    tcp.set_nodelay(true);
    tcp.set_keepalive(Some(KEEP_ALIVE));
    tcp.set_connect_timeout(Some(ATTEMPT));
    tcp
}

/// What holds for every connection over a network.
fn dialled(endpoint: Endpoint, once: bool) -> Endpoint {
    let endpoint =
        with_windows(endpoint).connect_timeout(ATTEMPT).tcp_nodelay(true).tcp_keepalive(Some(KEEP_ALIVE));
    if once {
        // TCP's keep-alive alone: the system answers it even for a coordinator that is stopped, and not for a host that is gone.
        return endpoint;
    }
    endpoint
        .http2_keep_alive_interval(KEEP_ALIVE)
        .keep_alive_timeout(KEEP_ALIVE_PATIENCE)
        .keep_alive_while_idle(true)
}

/// A connection that is never made.
#[cfg(test)]
pub(crate) fn nowhere() -> Proven {
    InterceptedService::new(Endpoint::from_static("http://nowhere").connect_lazy(), Proof(None))
}

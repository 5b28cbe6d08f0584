//! Callers that were refused: counted, and told ever more rarely, so that a flood of them costs no more than a few.

use std::collections::BTreeMap;
use std::fmt;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};

use crate::FleetEvent;

/// Where an event goes.
type Tell = Box<dyn Fn(FleetEvent) + Send + Sync>;

/// Why a caller is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// It hung up before it was known.
    HungUp,
    /// It speaks no TLS.
    NoTls,
    /// It does not take the coordinator for the one that it looks for.
    Distrusts,
    /// Another fault of its TLS.
    Tls(String),
    /// Its call has no token.
    NoToken,
    /// Its call has another token.
    OtherToken,
    /// It did not prove itself in time, or had to make room for others.
    Silent,
}

/// Longest text of a fault, characters.
const LONGEST: usize = 120;

impl Why {
    /// What the end of a handshake says.
    pub(super) fn of_handshake(error: &std::io::Error) -> Self {
        use tokio_rustls::rustls::{AlertDescription, Error};
        let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<Error>());
        match inner {
            Some(Error::InvalidMessage(_)) => Self::NoTls,
            Some(Error::AlertReceived(
                AlertDescription::UnknownCA
                | AlertDescription::BadCertificate
                | AlertDescription::CertificateUnknown
                | AlertDescription::DecryptError,
            )) => Self::Distrusts,
            Some(other) => Self::Tls(other.to_string().chars().take(LONGEST).collect()),
            None => Self::HungUp,
        }
    }

    /// A number for every kind.
    fn kind(&self) -> u8 {
        match self {
            Self::HungUp => 0,
            Self::NoTls => 1,
            Self::Distrusts => 2,
            Self::Tls(_) => 3,
            Self::NoToken => 4,
            Self::OtherToken => 5,
            Self::Silent => 6,
        }
    }
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::HungUp => "it hung up before it had proved itself",
            Self::NoTls => "it does not speak TLS; a worker needs --access FILE",
            Self::Distrusts => {
                "it takes this coordinator for another one: its access file is of another run or an old copy"
            }
            Self::Tls(fault) => return write!(f, "its TLS failed: {fault}"),
            Self::NoToken => "it sent no token; a worker needs --access FILE",
            Self::OtherToken => {
                "its token is not this run's: give the worker a fresh copy of the access file"
            }
            Self::Silent => "it did not prove itself in time",
        })
    }
}

/// Counts them.
pub(crate) struct Refusals {
    tell: Tell,
    counted: Mutex<Counted>,
}

#[derive(Default)]
struct Counted {
    by_kind: BTreeMap<u8, u64>,
    all: u64,
    last: Option<String>,
}

impl Refusals {
    pub(crate) fn new(tell: impl Fn(FleetEvent) + Send + Sync + 'static) -> Arc<Self> {
        Arc::new(Self { tell: Box::new(tell), counted: Mutex::default() })
    }

    /// One more. The first of a kind is told, then the tenth, the hundredth and so on.
    pub(super) fn note(&self, peer: IpAddr, why: &Why) {
        let mut counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        counted.all += 1;
        counted.last = Some(format!("a caller from {peer}: {why}"));
        let count = counted.by_kind.entry(why.kind()).or_default();
        *count += 1;
        let count = *count;
        drop(counted);
        if is_power_of_ten(count) {
            (self.tell)(FleetEvent::CallerRefused { from: peer.to_string(), reason: why.to_string(), count });
        }
    }

    /// How many there were, and the last of them.
    pub(crate) fn summary(&self) -> Option<String> {
        let counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        let last = counted.last.as_ref()?;
        Some(match counted.all {
            1 => format!("one caller was refused: {last}"),
            n => format!("{n} callers were refused, last {last}"),
        })
    }
}

/// The callers that a fleet refused, for whoever waits for workers.
#[derive(Clone)]
pub struct Refused(Arc<Refusals>);

impl Refused {
    pub(crate) fn new(refusals: Arc<Refusals>) -> Self {
        Self(refusals)
    }

    /// How many there were, and the last of them with the reason; nothing where there was none.
    pub fn summary(&self) -> Option<String> {
        self.0.summary()
    }
}

fn is_power_of_ten(n: u64) -> bool {
    n > 0 && 10_u64.pow(n.ilog10()) == n
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn a_flood_of_refused_callers_is_a_handful_of_events() {
        let (sender, told) = mpsc::channel();
        let refusals = Refusals::new(move |event| drop(sender.send(event)));
        assert_eq!(refusals.summary(), None);
        let peer = IpAddr::V4(Ipv4Addr::LOCALHOST);
        for _ in 0..100_000 {
            refusals.note(peer, &Why::NoTls);
        }
        refusals.note(peer, &Why::OtherToken);
        let counts: Vec<u64> = told
            .try_iter()
            .map(|event| match event {
                FleetEvent::CallerRefused { count, .. } => count,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(counts, [1, 10, 100, 1000, 10_000, 100_000, 1]);
        let says = refusals.summary().unwrap();
        assert!(says.contains("100001 callers were refused") && says.contains("fresh copy"), "{says}");
    }
}

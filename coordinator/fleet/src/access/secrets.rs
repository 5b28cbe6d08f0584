//! The secrets of a run: the certificate by which workers know the coordinator, and the token by which it knows them.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use serde::{Deserialize, Serialize};
use starlings_proto::access::{SERVER_NAME, Token};
use starlings_proto::private_file;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::CryptoProvider;
use tokio_rustls::rustls::crypto::ring::cipher_suite::{
    TLS13_AES_128_GCM_SHA256, TLS13_AES_256_GCM_SHA384, TLS13_CHACHA20_POLY1305_SHA256,
};
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::version::TLS13;

use super::AccessFault;

/// Number of the format of the private part.
const FORMAT: u32 = 1;

/// An authority that signed one certificate and whose key is forgotten; that certificate with its key; and a token.
#[derive(Clone, Serialize, Deserialize)]
pub struct Secrets {
    #[serde(rename = "starlings_access_key")]
    format: u32,
    /// The authority's certificate, PEM.
    pub(super) authority: String,
    /// The coordinator's certificate, PEM.
    certificate: String,
    /// Its key, PEM.
    key: String,
    pub(super) token: Token,
}

impl fmt::Debug for Secrets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Secrets").finish_non_exhaustive()
    }
}

impl Secrets {
    /// New ones.
    ///
    /// # Errors
    /// When the system gives no random bits.
    pub fn draw() -> Result<Self, AccessFault> {
        let mut bits = [0; 32];
        getrandom::fill(&mut bits).map_err(|error| AccessFault::Draw(error.to_string()))?;
        let made = certificates().map_err(|error| AccessFault::Draw(error.to_string()))?;
        let [authority, certificate, key] = made;
        Ok(Self { format: FORMAT, authority, certificate, key, token: Token::of(&bits) })
    }

    /// Those of a private part.
    pub(super) fn read(path: &Path) -> Result<Self, AccessFault> {
        let damaged = |reason: String| AccessFault::Damaged { path: path.to_owned(), reason };
        let text = private_file::read(path)?;
        let read: Self = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if read.format != FORMAT {
            return Err(damaged(format!("format {}, this program reads {FORMAT}", read.format)));
        }
        read.server().map_err(damaged)?;
        Ok(read)
    }

    /// The private part.
    pub(super) fn text(&self) -> String {
        // Texts and a number always have JSON.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// What proves a worker.
    pub fn token(&self) -> &Token {
        &self.token
    }

    /// The authority's certificate, PEM: what proves the coordinator.
    pub fn authority(&self) -> &str {
        &self.authority
    }

    /// How the coordinator speaks TLS: version 1.3 only, nothing before the handshake is done, and the cipher that takes the least time
    /// first, since states of many megabytes pass through it on one thread.
    pub(crate) fn server(&self) -> Result<Arc<ServerConfig>, String> {
        let chain = CertificateDer::from_pem_slice(self.certificate.as_bytes()).map_err(|e| e.to_string())?;
        let key = PrivateKeyDer::from_pem_slice(self.key.as_bytes()).map_err(|e| e.to_string())?;
        let ciphers =
            vec![TLS13_AES_128_GCM_SHA256, TLS13_AES_256_GCM_SHA384, TLS13_CHACHA20_POLY1305_SHA256];
        let provider = CryptoProvider { cipher_suites: ciphers, ..default_provider() };
        let config = ServerConfig::builder_with_provider(Arc::new(provider))
            .with_protocol_versions(&[&TLS13])
            .map_err(|e| e.to_string())?
            .with_no_client_auth()
            .with_single_cert(vec![chain], key);
        let mut config = config.map_err(|e| e.to_string())?;
        config.ignore_client_order = true;
        config.alpn_protocols = vec![b"h2".to_vec()];
        Ok(Arc::new(config))
    }
}

/// An authority, a certificate that it signed, and the key of that, each as PEM. They hold no name of the run, since whoever
/// connects sees them, and they do not expire: a clock that is wrong must not end a run, and both end with it.
fn certificates() -> Result<[String; 3], rcgen::Error> {
    let mut params = CertificateParams::default();
    params.distinguished_name.push(DnType::CommonName, "starlings authority");
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
    let signer = KeyPair::generate()?;
    let authority = params.self_signed(&signer)?;
    let issuer = Issuer::new(params, signer);
    let mut params = CertificateParams::new([SERVER_NAME.to_owned()])?;
    params.distinguished_name.push(DnType::CommonName, "starlings coordinator");
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    let key = KeyPair::generate()?;
    let certificate = params.signed_by(&key, &issuer)?;
    Ok([authority.pem(), certificate.pem(), key.serialize_pem()])
}

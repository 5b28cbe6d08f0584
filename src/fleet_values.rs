//! What the values of options of the fleet mean.

use std::net::{IpAddr, SocketAddr, ToSocketAddrs};

use starlings_coordinator::study::bytes_of;

use crate::failure::Failure;

/// Where to serve something over HTTP: for this machine alone, unless a host is named.
pub(crate) fn served_address(option: &str, text: &str) -> Result<SocketAddr, Failure> {
    let port = text.strip_prefix(':').unwrap_or(text);
    if port.parse::<u16>().is_ok() {
        return address(option, &format!("127.0.0.1:{port}"));
    }
    address(option, text)
}

/// Where to listen, as it was asked for by an option.
pub(crate) fn address(option: &str, text: &str) -> Result<SocketAddr, Failure> {
    let all: Vec<_> = text.to_socket_addrs().map(Iterator::collect).unwrap_or_default();
    // A name may lead to this machine alone and to its network.
    let others = all.iter().find(|address| !address.ip().is_loopback());
    others
        .or(all.first())
        .copied()
        .ok_or_else(|| Failure::input(format!("{option} {text}: expected HOST:PORT, such as 127.0.0.1:7000")))
}

/// The host of where to listen, where it is named and not numbered.
pub(crate) fn host_of(listen: &str) -> Option<&str> {
    let host = listen.rsplit_once(':')?.0;
    Some(host).filter(|host| host.trim_matches(['[', ']']).parse::<IpAddr>().is_err())
}

/// What to say of a name that leads to this machine alone; one that says so itself is meant so.
pub(crate) fn alone(host: &str, address: SocketAddr) -> Option<String> {
    let is_meant = host.is_empty() || host.eq_ignore_ascii_case("localhost");
    (address.ip().is_loopback() && !is_meant).then(|| {
        format!(
            "{host} is {} here, which no other machine can reach: give an address of this machine, or 0.0.0.0:{} for all of them",
            address.ip(),
            address.port()
        )
    })
}

/// Bytes of an amount such as `8 GiB`.
pub(crate) fn memory(text: &str) -> Result<usize, String> {
    let bytes = bytes_of(text).filter(|bytes| (0.0..1e18).contains(bytes));
    bytes
        .map(|bytes| bytes as usize)
        .ok_or_else(|| "expected a number with its unit, such as \"8 GiB\"".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_served_is_for_this_machine_unless_a_host_is_named() {
        let at = |text| served_address("--metrics", text).map(|address| address.to_string()).map_err(|_| ());
        assert_eq!(at("9464"), Ok("127.0.0.1:9464".to_owned()));
        assert_eq!(at(":0"), Ok("127.0.0.1:0".to_owned()));
        assert_eq!(at("0.0.0.0:9464"), Ok("0.0.0.0:9464".to_owned()));
        assert_eq!([at("nowhere"), at("70000")], [Err(()), Err(())]);
    }

    #[test]
    fn a_name_that_leads_to_this_machine_alone_is_told_and_one_that_means_it_is_not() {
        let loopback = "127.0.1.1:7000".parse::<SocketAddr>().expect("an address");
        let told = alone("login1", loopback).expect("it is told");
        assert!(told.starts_with("login1 is 127.0.1.1 here") && told.contains("0.0.0.0:7000"), "{told}");
        assert_eq!(alone("localhost", loopback), None);
        assert_eq!(alone("login1", "10.0.0.7:7000".parse().expect("an address")), None);
        assert_eq!(host_of("login1:7000"), Some("login1"));
        assert_eq!([host_of("127.0.0.1:0"), host_of("[::1]:0")], [None, None]);
    }
}

//! Where workers on other machines may find an address that this one listens on.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};

use starlings_proto::host::host_name;

/// The address as others dial it, the likeliest first; where it is every address of this machine: its name, the address from
/// which it sends to others, and loopback. A wrong one does no harm: whoever answers there lacks the certificate.
pub(super) fn addresses(address: SocketAddr, given: Option<&str>) -> Vec<String> {
    let port = address.port();
    let named = |host: &str| format!("{host}:{port}");
    let ip = |ip: IpAddr| SocketAddr::new(ip, port).to_string();
    let mut found: Vec<String> = given.map(named).into_iter().collect();
    if address.ip().is_unspecified() {
        found.extend(host_name().map(|name| named(&name)));
        found.extend(sends_from().map(ip));
        found.push(ip(Ipv4Addr::LOCALHOST.into()));
    } else {
        found.push(ip(address.ip()));
    }
    let mut seen = std::collections::BTreeSet::new();
    found.retain(|address| seen.insert(address.clone()));
    found
}

/// The address of the interface that leads elsewhere. Nothing is sent: the system only looks the way up.
fn sends_from() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    // An address of the block that is kept free for documentation.
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    Some(socket.local_addr().ok()?.ip()).filter(|ip| !ip.is_unspecified())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certain_address_is_told_as_it_is_and_any_address_as_those_that_others_dial() {
        let own = |text: &str| text.parse::<SocketAddr>().unwrap();
        assert_eq!(addresses(own("10.0.0.7:7000"), None), ["10.0.0.7:7000"]);
        assert_eq!(addresses(own("10.0.0.7:7000"), Some("node7")), ["node7:7000", "10.0.0.7:7000"]);
        assert_eq!(addresses(own("[::1]:7000"), None), ["[::1]:7000"]);
        for any in ["0.0.0.0:7000", "[::]:7000"] {
            let told = addresses(own(any), None);
            assert!(told.iter().all(|address| !address.contains("0.0.0.0") && !address.contains("[::]")));
            assert_eq!(told.last().map(String::as_str), Some("127.0.0.1:7000"));
        }
    }
}

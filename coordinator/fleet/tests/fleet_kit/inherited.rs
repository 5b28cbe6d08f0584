//! A worker played by hand in a process of its own, on the connection and the descriptors that it inherited.

use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;

use hyper_util::rt::TokioIo;
use starlings_fleet::{GrpcFleet, LocalConfig, LocalWorkers};
use starlings_proto::Hello;
use starlings_proto::descriptors::{DescriptorReceiver, offered};
use starlings_proto::generated::fleet_client::FleetClient;
use starlings_proto::socket::SocketEnd;
use tonic::transport::{Endpoint, Uri};

use super::hand::Hand;

/// The variable that tells a process of the tests that it is a worker: what it is to do.
pub const PART: &str = "TEST_WORKER_PART";

/// What this process is to do as a worker; `None` where it is none.
pub fn part() -> Option<String> {
    std::env::var(PART).ok()
}

/// Processes of this test program as workers, each of which plays this part in the test named.
pub fn workers(fleet: &GrpcFleet, n: usize, test: &str, part: &str) -> LocalWorkers {
    workers_after("", fleet, n, test, part)
}

/// The same after these words of the shell.
pub fn workers_after(words: &str, fleet: &GrpcFleet, n: usize, test: &str, part: &str) -> LocalWorkers {
    let this = std::env::current_exe().unwrap();
    let script = format!(
        "{words} export {PART}={part}; exec '{}' --exact {test} --ignored --nocapture --test-threads 1",
        this.display()
    );
    let args = ["-c", &script, "worker"].map(str::to_owned).to_vec();
    LocalWorkers::spawn(LocalConfig { program: "/bin/sh".into(), args, n, fleet: fleet.handle() }).unwrap()
}

/// A worker on the standard input, and where its descriptors come.
pub async fn hand(hello: Hello) -> (Hand, Arc<DescriptorReceiver>) {
    let socket = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned().unwrap());
    let descriptors = offered(&socket).unwrap().expect("the coordinator offers a way");
    let mut socket = Some(SocketEnd::new(socket).unwrap());
    let connect = move |_: Uri| {
        let socket = socket.take().map(TokioIo::new).ok_or_else(|| std::io::Error::other("once"));
        std::future::ready(socket)
    };
    let endpoint = Endpoint::from_static("http://coordinator");
    let channel = endpoint.connect_with_connector(tower::service_fn(connect)).await.unwrap();
    (Hand::over(FleetClient::new(channel), hello).await, descriptors)
}

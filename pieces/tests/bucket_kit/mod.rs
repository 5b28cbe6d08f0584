//! A real server of Amazon's protocol with a bucket in it: moto's, which `.ci/s3` installs.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::print_stdout, clippy::missing_panics_doc)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Where the server is in the repository, once it is installed.
const PROGRAM: &str = "target/s3/bin/moto_server";

/// The server of a test; dropped, it ends.
pub struct Server {
    process: Child,
    /// Host and port.
    pub address: String,
    /// Objects that were put into the bucket so far.
    put: Arc<AtomicUsize>,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Server {
    /// Starts one with a bucket `states`, where there is a program for it.
    pub fn start() -> Option<Self> {
        let own = Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .map(|folder| folder.join(PROGRAM))
            .find(|program| program.exists());
        let mut command = Command::new(own.unwrap_or_else(|| "moto_server".into()));
        command.args(["-H", "127.0.0.1", "-p", "0"]).stdout(Stdio::null()).stderr(Stdio::piped());
        let Ok(mut process) = command.spawn() else {
            println!("left out: there is no moto_server; run .ci/s3");
            return None;
        };
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines();
        let line = said.find(|line| line.as_ref().unwrap().contains("Running on http://")).unwrap().unwrap();
        let address = line.split("http://").nth(1).unwrap().trim_matches('/').trim().to_owned();
        // It says every request, which would fill the pipe.
        let put = Arc::<AtomicUsize>::default();
        let counted = Arc::clone(&put);
        std::thread::spawn(move || {
            for _ in said.map_while(Result::ok).filter(|line| line.contains("\"PUT /states/")) {
                counted.fetch_add(1, Ordering::Relaxed);
            }
        });
        let server = Self { process, address, put };
        let made = server.ask("PUT", "/states");
        assert!(made.starts_with("HTTP/1.1 200"), "{made}");
        Some(server)
    }

    /// The answer to a request without a body.
    fn ask(&self, method: &str, path: &str) -> String {
        let mut connection = TcpStream::connect(&self.address).unwrap();
        let host = &self.address;
        write!(
            connection,
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
        )
        .unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    }

    /// Objects in the bucket, a thousand at most.
    pub fn n_object(&self) -> usize {
        self.ask("GET", "/states?list-type=2").matches("<Key>").count()
    }

    /// Objects that were put into the bucket since its start.
    pub fn n_put(&self) -> usize {
        self.put.load(Ordering::Relaxed)
    }

    /// What a program has to find in its environment to reach it.
    pub fn environment(&self) -> [(&'static str, String); 5] {
        [
            ("AWS_ENDPOINT", format!("http://{}", self.address)),
            ("AWS_ALLOW_HTTP", "true".to_owned()),
            ("AWS_ACCESS_KEY_ID", "test".to_owned()),
            ("AWS_SECRET_ACCESS_KEY", "test".to_owned()),
            ("AWS_REGION", "us-east-1".to_owned()),
        ]
    }
}

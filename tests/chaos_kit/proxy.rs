//! A way from a worker to the coordinator that the test holds in its hands: it cuts, holds up and damages what it carries.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::draw::Draw;

/// What happens to a piece on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Damage {
    /// One bit is another.
    Flip,
    /// Bytes are missing.
    Shorten,
    /// There are more of them.
    Lengthen,
}

#[derive(Default)]
struct Shared {
    /// Nothing passes, and nothing is closed.
    held: AtomicBool,
    /// For the next piece towards the coordinator, and for the next one towards the worker.
    damage: [Mutex<Option<(Damage, Draw)>>; 2],
    open: Mutex<Vec<TcpStream>>,
}

/// A port on loopback behind which the coordinator is.
pub(crate) struct Proxy {
    pub(crate) address: SocketAddr,
    shared: Arc<Shared>,
}

impl Proxy {
    pub(crate) fn to(coordinator: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (address, shared) = (listener.local_addr().unwrap(), Arc::<Shared>::default());
        let kept = Arc::clone(&shared);
        std::thread::spawn(move || {
            for worker in listener.incoming().filter_map(Result::ok) {
                // Nobody holds this proxy any more.
                if Arc::strong_count(&kept) == 1 {
                    return;
                }
                if let Ok(coordinator) = TcpStream::connect(coordinator) {
                    carry_both(&worker, &coordinator, &kept);
                }
            }
        });
        Self { address, shared }
    }

    /// Closes all connections.
    pub(crate) fn cut(&self) {
        for stream in self.shared.open.lock().unwrap().drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Lets nothing pass, or everything again.
    pub(crate) fn hold(&self, is_held: bool) {
        self.shared.held.store(is_held, Ordering::SeqCst);
    }

    /// Damages the next piece that passes, unless another damage waits for it.
    pub(crate) fn damage(&self, damage: Damage, mut draw: Draw) -> bool {
        let next = &mut *self.shared.damage[draw.below(2) as usize].lock().unwrap();
        let is_first = next.is_none();
        next.get_or_insert((damage, draw));
        is_first
    }

    /// Takes back the damage that no piece has met; how many there were.
    pub(crate) fn undamage(&self) -> usize {
        self.shared.damage.iter().filter_map(|damage| damage.lock().unwrap().take()).count()
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.cut();
        self.hold(false);
        let address = self.address;
        self.shared = Arc::default();
        // It wakes the listener, which sees that it is alone.
        let _ = TcpStream::connect(address);
    }
}

fn carry_both(worker: &TcpStream, coordinator: &TcpStream, shared: &Arc<Shared>) {
    let again = |stream: &TcpStream| stream.try_clone().unwrap();
    shared.open.lock().unwrap().extend([again(worker), again(coordinator)]);
    for (direction, from, to) in [(0, worker, coordinator), (1, coordinator, worker)] {
        let _ = from.set_nodelay(true);
        let (from, to, shared) = (again(from), again(to), Arc::clone(shared));
        std::thread::spawn(move || {
            let _ = carry(&from, &to, direction, &shared);
            for stream in [from, to] {
                let _ = stream.shutdown(Shutdown::Both);
            }
        });
    }
}

fn carry(mut from: &TcpStream, mut to: &TcpStream, direction: usize, shared: &Shared) -> std::io::Result<()> {
    let mut piece = vec![0; 1 << 16];
    loop {
        let n = from.read(&mut piece)?;
        while shared.held.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(2));
        }
        if n == 0 {
            return Ok(());
        }
        let damage = shared.damage[direction].lock().unwrap().take();
        match damage {
            None => to.write_all(&piece[..n])?,
            Some((damage, draw)) => to.write_all(&damaged(&piece[..n], damage, draw))?,
        }
    }
}

fn damaged(piece: &[u8], damage: Damage, mut draw: Draw) -> Vec<u8> {
    let mut bytes = piece.to_vec();
    let at = draw.below(bytes.len() as u64) as usize;
    match damage {
        Damage::Flip => bytes[at] ^= 1 << draw.below(8),
        Damage::Shorten => {
            let n = 1 + draw.below((bytes.len() - at) as u64) as usize;
            bytes.drain(at..at + n);
        }
        Damage::Lengthen => {
            let more: Vec<u8> = (0..=draw.below(64)).map(|_| draw.next() as u8).collect();
            bytes.splice(at..at, more);
        }
    }
    bytes
}

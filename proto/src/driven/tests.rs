//! Who drives when: nothing stands still, whoever waits or not.

use std::io::Read;
use std::sync::mpsc;
use std::time::Duration;

use tokio::net::UnixStream;
use tokio::sync::Notify;

use super::*;

/// Far above what anything here takes.
const LONG: Duration = Duration::from_secs(60);

/// A network with its keeper, which ends when it is told to.
struct Kept {
    network: Arc<Driven>,
    end: Arc<Notify>,
    keeper: std::thread::JoinHandle<Result<&'static str, JoinError>>,
}

impl Kept {
    fn new() -> Self {
        let (network, end) = (Arc::new(Driven::new().unwrap()), Arc::new(Notify::new()));
        let (own, told) = (Arc::clone(&network), Arc::clone(&end));
        let work = async move {
            told.notified().await;
            "told"
        };
        let keeper = std::thread::spawn(move || own.keep(work));
        Self { network, end, keeper }
    }

    /// Has the network do something that takes so long; who hears of it does not drive.
    fn after(&self, wait: Duration) -> mpsc::Receiver<()> {
        let (done, heard) = mpsc::channel();
        self.network.handle().spawn(async move {
            tokio::time::sleep(wait).await;
            done.send(())
        });
        heard
    }

    fn end(self) {
        self.end.notify_one();
        assert_eq!(self.keeper.join().unwrap().unwrap(), "told");
    }
}

/// Sends a byte there and back on sockets of the network.
async fn echo() {
    let (near, far) = UnixStream::pair().unwrap();
    let answers = tokio::spawn(async move {
        far.readable().await.unwrap();
        far.writable().await.unwrap();
        far.try_write(b"a").unwrap()
    });
    near.writable().await.unwrap();
    near.try_write(b"q").unwrap();
    near.readable().await.unwrap();
    assert_eq!(answers.await.unwrap(), 1);
}

#[test]
fn whoever_waits_drives() {
    let network = Driven::new().unwrap();
    assert_eq!(network.wait(echo()), Some(()));
    // From several threads at once: one drives, all go on.
    std::thread::scope(|threads| {
        for _ in 0..4 {
            threads.spawn(|| (0..200).for_each(|_| assert_eq!(network.wait(echo()), Some(()))));
        }
    });
}

#[test]
fn the_keeper_drives_while_nobody_waits_also_after_somebody_did_for_long() {
    let kept = Kept::new();
    kept.after(Duration::from_millis(20)).recv_timeout(LONG).unwrap();
    for waits in [Duration::ZERO, LOOK, 4 * LONGEST_LOOK] {
        // By then it sleeps, where that is longest.
        kept.network.wait(echo()).unwrap();
        kept.network.wait(async { tokio::time::sleep(waits).await }).unwrap();
        kept.after(Duration::from_millis(20)).recv_timeout(LONG).unwrap();
    }
    kept.network.wait(echo()).unwrap();
    kept.network.leave();
    kept.after(Duration::ZERO).recv_timeout(LONG).unwrap();
    kept.end();
}

#[test]
fn a_glance_does_what_can_be_done_at_once() {
    let network = Driven::new().unwrap();
    let (done, heard) = mpsc::channel();
    network.handle().spawn(async move { done.send(()) });
    assert!(heard.try_recv().is_err());
    network.glance();
    heard.try_recv().unwrap();
}

#[test]
fn turns_of_many_threads_and_the_keeper_lose_nothing() {
    let kept = Kept::new();
    std::thread::scope(|threads| {
        for thread in 0..3_u64 {
            let kept = &kept;
            threads.spawn(move || {
                for turn in 0..300 {
                    let heard = kept.after(Duration::ZERO);
                    match (turn + thread) % 3 {
                        0 => kept.network.wait(echo()).unwrap(),
                        1 => kept.network.glance(),
                        _ => kept.network.leave(),
                    }
                    heard.recv_timeout(LONG).unwrap();
                }
            });
        }
    });
    kept.end();
}

#[test]
fn nobody_waits_for_a_network_that_has_ended() {
    let kept = Kept::new();
    let network = Arc::clone(&kept.network);
    let (near, mut far) = std::os::unix::net::UnixStream::pair().unwrap();
    near.set_nonblocking(true).unwrap();
    far.set_nonblocking(true).unwrap();
    network.handle().spawn(async move {
        let _open = UnixStream::from_std(near).unwrap();
        std::future::pending::<()>().await;
    });
    std::thread::scope(|threads| {
        let waiting = [(); 3].map(|()| threads.spawn(|| network.wait(std::future::pending::<()>())));
        while network.waiting.load(SeqCst) < 3 {
            std::thread::yield_now();
        }
        kept.end();
        // All that was open is closed by now.
        assert_eq!(far.read(&mut [0]).unwrap(), 0);
        for thread in waiting {
            assert_eq!(thread.join().unwrap(), None);
        }
    });
    assert_eq!(network.wait(async {}), None);
    network.glance();
    network.leave();
}

#[test]
fn a_panic_of_the_work_ends_the_network_and_is_told() {
    let network = Driven::new().unwrap();
    let ended: Result<(), _> = network.keep(async { panic!("broken") });
    assert!(ended.unwrap_err().is_panic());
    assert_eq!(network.wait(async {}), None);
}

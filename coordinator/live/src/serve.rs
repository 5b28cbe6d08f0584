//! The page of one command: who looks at it, what they are shown, and its end.
//!
//! While nobody looks nothing is read or made. While somebody does, one task makes a view ten times a second at most, and every viewer
//! takes the one that is newest when his connection has room. Next file to read: [`super::routes`].

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use starlings_fleet::{FleetEvent, Readings};
use starlings_metrics::{Address, ServeError, Server};
use starlings_proto::access::Token;
use starlings_study::RunFolder;
use tokio::sync::watch;

use super::course::Course;
use super::told::Told;
use super::view::{Head, Standing, State, View};

/// Time between two views at least.
const EVERY: Duration = Duration::from_millis(100);
/// After so many of them a view is sent though nothing has changed.
const HEARTBEAT: u32 = 10;
/// Viewers at most.
pub(crate) const VIEWERS: usize = 64;
/// How long the end of a command waits for those who look: to be told, and to ask for the report.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often it looks whether they were.
const LOOK: Duration = Duration::from_millis(5);

/// Seconds since the command began.
pub type Clock = Arc<dyn Fn() -> f64 + Send + Sync>;

/// What is shown of a command, to be told how it goes on.
#[derive(Clone)]
pub struct Live(Arc<Shared>);

struct Shared {
    head: Head,
    fleet: Readings,
    folder: Option<PathBuf>,
    token: Token,
    clock: Clock,
    told: Mutex<Told>,
    seen: Mutex<Seen>,
    report: Mutex<Option<PathBuf>>,
    reports_given: AtomicUsize,
    ticks: watch::Sender<()>,
}

/// What the last view was made of.
#[derive(Default)]
struct Seen {
    is_ticking: bool,
    folder: Option<RunFolder>,
    course: Course,
    /// The view as JSON, without the time.
    view: Arc<str>,
    elapsed_s: f64,
    /// Views since the last one that was sent.
    unsent: u32,
    /// Somebody came.
    is_asked: bool,
    /// The command was over when it was made.
    is_last: bool,
    /// Failures by type, which the fleet takes with it.
    failures: Vec<(String, u64)>,
}

/// Generation and number of points that a viewer has.
pub(crate) type Mark = (u64, usize);

/// What a viewer is sent.
pub(crate) struct Sent {
    pub(crate) text: String,
    pub(crate) mark: Mark,
    pub(crate) is_last: bool,
}

impl Live {
    /// A command with its fleet, and the folder of its run where there is one.
    ///
    /// # Errors
    /// When the system gives no random bits.
    pub fn new(
        head: Head,
        fleet: Readings,
        folder: Option<&Path>,
        clock: Clock,
    ) -> Result<Self, getrandom::Error> {
        let mut bits = [0; 32];
        getrandom::fill(&mut bits)?;
        Ok(Self(Arc::new(Shared {
            head,
            fleet,
            folder: folder.map(Path::to_owned),
            token: Token::of(&bits),
            clock,
            told: Mutex::default(),
            seen: Mutex::default(),
            report: Mutex::default(),
            reports_given: AtomicUsize::new(0),
            ticks: watch::channel(()).0,
        })))
    }

    /// The fleet tells something.
    pub fn event(&self, event: &FleetEvent) {
        if event.is_lasting() {
            lock(&self.0.told).event((self.0.clock)(), event);
        }
    }

    /// The work stands here.
    pub fn stands(&self, standing: Standing) {
        lock(&self.0.told).stands(standing);
    }

    /// A command whose work has stages is in this one.
    pub fn stage(&self, standing: Standing) {
        let now = (self.0.clock)();
        lock(&self.0.told).stage(now, standing);
    }

    pub(crate) fn token(&self) -> &Token {
        &self.0.token
    }

    /// Everything as it is now.
    pub(crate) fn now(&self) -> View {
        let mut seen = lock(&self.0.seen);
        let mut view = self.look(&mut seen, true);
        view.elapsed_s = (self.0.clock)();
        if !seen.is_ticking {
            seen.folder = None;
        }
        view
    }

    /// One viewer more, who hears when there is something new; `None` where there are too many.
    pub(crate) fn subscribe(&self) -> Option<watch::Receiver<()>> {
        if self.0.ticks.receiver_count() >= VIEWERS {
            return None;
        }
        let heard = self.0.ticks.subscribe();
        let mut seen = lock(&self.0.seen);
        seen.is_asked = true;
        if !seen.is_ticking {
            seen.is_ticking = true;
            tokio::spawn(self.clone().tick());
        }
        Some(heard)
    }

    /// Makes views until nobody looks.
    async fn tick(self) {
        let mut every = tokio::time::interval(EVERY);
        every.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            every.tick().await;
            let mut seen = lock(&self.0.seen);
            if self.0.ticks.receiver_count() == 0 {
                // The next viewer reads from the beginning, or from where this one came to: both are the same course.
                (seen.is_ticking, seen.folder) = (false, None);
                return;
            }
            let mark = seen.course.mark();
            let is_over = lock(&self.0.told).state != State::Running;
            let view = self.look(&mut seen, is_over);
            // Texts and numbers always have JSON.
            let text: Arc<str> = serde_json::to_string(&view).unwrap_or_default().into();
            let is_new = seen.view != text || seen.course.mark() != mark || seen.is_asked;
            seen.unsent += 1;
            if is_new || seen.unsent >= HEARTBEAT || view.state != State::Running {
                (seen.view, seen.elapsed_s) = (text, (self.0.clock)());
                (seen.unsent, seen.is_asked) = (0, false);
                seen.is_last = view.state != State::Running;
                self.0.ticks.send_replace(());
            }
        }
    }

    /// A view without the time, after a look at the store: a part of what is new there, or `to_the_end`.
    fn look(&self, seen: &mut Seen, to_the_end: bool) -> View {
        let shared = &self.0;
        let mut view = View { head: shared.head.clone(), ..View::default() };
        if let Some(path) = &shared.folder {
            let read = match &mut seen.folder {
                Some(folder) => Ok(folder),
                none => RunFolder::open(path).map(|folder| none.insert(folder)),
            };
            let read = match read {
                Ok(folder) if to_the_end => seen.course.read_all(&folder.store),
                Ok(folder) => seen.course.read(&folder.store).map(drop),
                Err(error) => {
                    view.unreadable = Some(error.to_string());
                    Ok(())
                }
            };
            if let Err(error) = read {
                view.unreadable = Some(error.to_string());
            }
            seen.course.show(&mut view);
        }
        let fleet = shared.fleet.read().zip(shared.fleet.load());
        view.failures = std::mem::take(&mut seen.failures);
        lock(&shared.told).show(&mut view, fleet);
        seen.failures.clone_from(&view.failures);
        view.report = lock(&shared.report).is_some();
        view
    }

    /// What somebody is sent who has the points of a mark.
    pub(crate) fn since(&self, mark: Mark) -> Sent {
        let seen = lock(&self.0.seen);
        let (generation, from, points) = seen.course.since(mark);
        let (view, elapsed_s) = (&seen.view, seen.elapsed_s);
        let points = points.join(",");
        let text =
            format!(r#"{{"elapsed_s":{elapsed_s:.3},"from":{from},"points":[{points}],"view":{view}}}"#);
        Sent { text, mark: (generation, seen.course.mark().1), is_last: seen.is_last }
    }

    /// The report, once there is one.
    pub(crate) fn report(&self) -> Option<std::io::Result<Vec<u8>>> {
        let path = lock(&self.0.report).clone()?;
        let read = std::fs::read(path);
        self.0.reports_given.fetch_add(1, Ordering::Relaxed);
        Some(read)
    }

    /// Says that the command is over, and waits a moment until those who look have heard it and asked for the report.
    fn end(&self, state: State, why: &str, report: Option<PathBuf>) {
        let viewers = self.0.ticks.receiver_count();
        let wanted = if report.is_some() { viewers } else { 0 };
        *lock(&self.0.report) = report;
        let mut told = lock(&self.0.told);
        (told.state, told.ended) = (state, why.to_owned());
        drop(told);
        let is_told =
            || self.0.ticks.receiver_count() == 0 && self.0.reports_given.load(Ordering::Relaxed) >= wanted;
        let looks = PATIENCE.as_millis() / LOOK.as_millis();
        for _ in 0..looks {
            if is_told() {
                break;
            }
            std::thread::sleep(LOOK);
        }
    }
}

/// The page of a command while it is served; dropped, it says that the command ended before it was done.
pub struct LivePage {
    live: Live,
    address: SocketAddr,
    is_over: bool,
    _server: Server,
}

impl LivePage {
    /// Serves it.
    ///
    /// # Errors
    /// [`ServeError::Start`].
    pub fn serve(at: Address, live: Live) -> Result<Self, ServeError> {
        let address = at.address;
        let server = Server::start(at, super::routes::routes(live.clone()), PATIENCE)?;
        Ok(Self { live, address, is_over: false, _server: server })
    }

    /// Where it is, with what opens it.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.live.token().digits())
    }

    /// The command is done, and this is its report.
    pub fn finish(mut self, report: Option<&Path>) {
        self.is_over = true;
        self.live.end(State::Finished, "", report.filter(|path| path.is_file()).map(Path::to_owned));
    }
}

impl Drop for LivePage {
    fn drop(&mut self) {
        if !self.is_over {
            self.live.end(State::Ended, "The command ended before it was done; its terminal says why.", None);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

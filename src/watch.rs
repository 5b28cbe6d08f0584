//! `starlings watch`: a run in the terminal while it runs, by its folder or by the address of its live page.
//!
//! Next file to read: [`words`], for what is written.

mod words;

use std::io::IsTerminal;
use std::path::Path;
use std::time::Duration;

use clap::Parser;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use starlings_coordinator::live::{State, View, Watched};

use crate::console::{line, text};
use crate::failure::Failure;
use crate::plain::Plain;

/// Time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Time between two lines where no terminal is written to.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// The longest answer of a page that is waited for.
const PATIENCE: Duration = Duration::from_secs(10);
/// Looks without an answer after which a page is gone.
const MISSES: usize = 3;

/// Follow a run in the terminal, also over ssh: its folder, running, killed or finished, or the address of its live page.
///
/// It ends when the run does, and says how. Written to a file or another program it is a line every ten seconds.
#[derive(Parser)]
pub(crate) struct Args {
    /// The run folder, or the address that `--dashboard` printed.
    #[arg(value_name = "DIR|ADDR")]
    of: String,
    /// Print what is known now as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Where a run is looked at.
enum Source {
    Folder(Box<Watched>),
    Page { agent: ureq::Agent, url: String, last: Box<View>, misses: usize },
}

/// Follows it to its end.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut source = Source::open(&args.of)?;
    let mut view = source.look()?;
    if args.json {
        return line(serde_json::to_string_pretty(&view).map_err(Failure::run)?);
    }
    if std::io::stdout().is_terminal() && view.state == State::Running {
        let screen = screen();
        while view.state == State::Running {
            screen.set_message(Plain(words::screen(&view)).to_string());
            std::thread::sleep(LOOK_EVERY);
            view = source.look()?;
        }
        screen.finish_and_clear();
    } else {
        while view.state == State::Running {
            line(words::standing(&view))?;
            let mut waited = Duration::ZERO;
            while view.state == State::Running && waited < LINE_EVERY {
                std::thread::sleep(LOOK_EVERY);
                waited += LOOK_EVERY;
                view = source.look()?;
            }
        }
    }
    text(words::end(&view))
}

fn screen() -> ProgressBar {
    let screen = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout_with_hz(4));
    let style = ProgressStyle::with_template("{msg}");
    screen.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    screen
}

impl Source {
    fn open(of: &str) -> Result<Self, Failure> {
        if !of.starts_with("http://") {
            let folder = Watched::open(Path::new(of)).map_err(|error| {
                Failure::input(format!(
                    "{error}; watch takes the folder of a run or the address of a live page"
                ))
            })?;
            return Ok(Self::Folder(Box::new(folder)));
        }
        let config = ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).http_status_as_error(false);
        let agent = config.build().new_agent();
        let url = format!("{}/now", of.trim_end_matches('/'));
        let last = ask(&agent, &url).map_err(|why| Failure::input(format!("cannot watch {of}: {why}")))?;
        Ok(Self::Page { agent, url, last: Box::new(last), misses: 0 })
    }

    /// What is known now. A page that is gone has ended with its command.
    fn look(&mut self) -> Result<View, Failure> {
        match self {
            Self::Folder(folder) => folder.look().map_err(Failure::run),
            Self::Page { agent, url, last, misses } => {
                match ask(agent, url) {
                    Ok(view) => (**last, *misses) = (view, 0),
                    Err(why) => {
                        *misses += 1;
                        if *misses >= MISSES {
                            last.state = State::Ended;
                            last.ended =
                                format!("the page answers no longer ({why}): what is known is a moment old");
                        }
                    }
                }
                Ok((**last).clone())
            }
        }
    }
}

/// The newest view of a page.
fn ask(agent: &ureq::Agent, url: &str) -> Result<View, String> {
    let mut answer = agent.get(url).call().map_err(|error| error.to_string())?;
    let status = answer.status();
    if status != 200 {
        let says = answer.body_mut().read_to_string().unwrap_or_default();
        return Err(format!("it answers {status}: {}", says.trim()));
    }
    answer.body_mut().read_json().map_err(|error| format!("it answers what is no view of a run: {error}"))
}

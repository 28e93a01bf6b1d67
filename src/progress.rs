//! What a person sees on stderr while a command runs: bars, notes and warnings.
//!
//! On a terminal a step is a bar with its name, a count and the time left; elsewhere, and where `NO_COLOR` or `TERM=dumb` ask for
//! plain text, a line every few seconds. `--quiet` leaves warnings and errors alone. Nothing is said twice. A stderr that
//! cannot be written, closed or full, is no reason to stop: the results are files.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two lines where there is no bar.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

static QUIET: AtomicBool = AtomicBool::new(false);
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// No bars and no notes from now on.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// A step of a command. It is over when it is dropped.
pub struct Step {
    shown: Shown,
    begun: AtomicBool,
}

enum Shown {
    Nothing,
    Bar(ProgressBar),
    Lines { state: Arc<State>, stop: Option<Sender<()>>, ticker: Option<JoinHandle<()>> },
}

struct State {
    length: AtomicU64,
    done: AtomicU64,
    label: Mutex<String>,
    start: Instant,
}

/// Starts a step of `length` equal parts, 0 where their number is not known.
pub fn bar(label: &str, length: u64) -> Step {
    Step { shown: shown(label, length), begun: AtomicBool::new(false) }
}

fn shown(label: &str, length: u64) -> Shown {
    if QUIET.load(Ordering::Relaxed) {
        return Shown::Nothing;
    }
    let asked_for_plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty())
        || std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    if !asked_for_plain && std::io::stderr().is_terminal() {
        return Shown::Bar(drawn(label, length));
    }
    #[expect(clippy::disallowed_methods, reason = "only for the time left that is shown")]
    let start = Instant::now();
    let state = Arc::new(State {
        length: AtomicU64::new(length),
        done: AtomicU64::new(0),
        label: Mutex::new(label.to_owned()),
        start,
    });
    let (stop, stopped) = channel();
    let seen = Arc::clone(&state);
    let ticker = std::thread::Builder::new().spawn(move || {
        let mut last = String::new();
        while stopped.recv_timeout(BETWEEN_LINES) == Err(RecvTimeoutError::Timeout) {
            let now = seen.line();
            if now != last {
                line(&now);
            }
            last = now;
        }
    });
    Shown::Lines { state, stop: Some(stop), ticker: ticker.ok() }
}

fn drawn(label: &str, length: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let template =
        if length == 0 { "{msg:32} {elapsed} {spinner}" } else { "{msg:32} [{bar:28}] {pos}/{len}, {eta} left" };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.enable_steady_tick(Duration::from_millis(250));
    bar.with_message(label.to_owned())
}

impl State {
    fn line(&self) -> String {
        let label = self.label.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let (done, elapsed) = (self.done.load(Ordering::Relaxed), self.start.elapsed().as_secs_f64());
        let length = self.length.load(Ordering::Relaxed);
        if length == 0 {
            return format!("{label}: for {elapsed:.0} s now");
        }
        let left = match done {
            0 => String::new(),
            _ => format!(", about {:.0} s left", elapsed * length.saturating_sub(done) as f64 / done as f64),
        };
        format!("{label}: {done} of {length}{left}")
    }
}

impl Step {
    /// So many more parts are done.
    pub fn inc(&self, parts: u64) {
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.inc(parts),
            Shown::Lines { state, .. } => {
                state.done.fetch_add(parts, Ordering::Relaxed);
            }
        }
    }

    /// So many parts more than were thought of are to be done.
    pub fn lengthen(&self, parts: u64) {
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.inc_length(parts),
            Shown::Lines { state, .. } => {
                state.length.fetch_add(parts, Ordering::Relaxed);
            }
        }
    }

    /// A part of this name begins, and the one before it is done.
    pub fn begin(&self, part: &str) {
        if self.begun.swap(true, Ordering::Relaxed) {
            self.inc(1);
        }
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.set_message(part.to_owned()),
            Shown::Lines { state, .. } => {
                part.clone_into(&mut state.label.lock().unwrap_or_else(PoisonError::into_inner));
            }
        }
    }

    /// The step is over.
    pub fn finish_and_clear(self) {}
}

impl Drop for Step {
    fn drop(&mut self) {
        match &mut self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.finish_and_clear(),
            Shown::Lines { stop, ticker, .. } => {
                stop.take();
                if let Some(ticker) = ticker.take() {
                    // It only prints; how it ended makes no difference.
                    let _ = ticker.join();
                }
            }
        }
    }
}

/// A line on stderr that says what was done or left out.
pub fn note(message: impl AsRef<str>) {
    if !QUIET.load(Ordering::Relaxed) {
        once(message.as_ref().to_owned());
    }
}

/// A line on stderr that asks for attention.
pub fn warn(message: impl AsRef<str>) {
    once(format!("warning: {}", message.as_ref()));
}

fn once(message: String) {
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if !said.contains(&message) {
        line(&message);
        said.insert(message);
    }
}

/// One write a line, so that lines of several threads don't mix.
fn line(text: &str) {
    let _ = std::io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::disallowed_methods, reason = "a start is needed")]
    fn a_line_names_step_count_and_time_left() {
        let start = Instant::now() - Duration::from_secs(10);
        let length = AtomicU64::new(60);
        let state = State { length, done: AtomicU64::new(12), label: Mutex::new("looking".to_owned()), start };
        assert_eq!(state.line(), "looking: 12 of 60, about 40 s left");
        let state = State { length: AtomicU64::new(0), ..state };
        assert_eq!(state.line(), "looking: for 10 s now");
    }
}

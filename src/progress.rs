//! What a person sees on stderr while a command runs: bars, notes and warnings.
//!
//! On a terminal a step is a bar with its name, a count and the time left; elsewhere, and where `NO_COLOR` or
//! `TERM=dumb` ask for plain text, a line every few seconds. `--quiet` leaves warnings and errors alone. Nothing is
//! said twice. A stderr that cannot be written, closed or full, is no reason to stop: the results are files.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two lines where there is no bar.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

static QUIET: AtomicBool = AtomicBool::new(false);
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
static HELD: Mutex<Option<Vec<String>>> = Mutex::new(None);

/// No bars and no notes from now on.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// A step of a command. It is over when it is dropped.
pub struct Step {
    /// Not drawn where lines are said, or nothing.
    bar: ProgressBar,
    begun: AtomicBool,
    /// What says lines, and what stops it when it is dropped.
    ticker: Option<(Sender<()>, JoinHandle<()>)>,
}

/// Starts a step of `length` equal parts, 0 where their number is not known.
pub fn bar(label: &str, length: u64) -> Step {
    let is_quiet = QUIET.load(Ordering::Relaxed);
    let asked_for_plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty())
        || std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    let is_drawn = !is_quiet && !asked_for_plain && std::io::stderr().is_terminal();
    let target = if is_drawn { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    if is_drawn {
        let template =
            if length == 0 { "{msg:32} {elapsed} {spinner}" } else { "{msg:32} [{bar:28}] {pos}/{len}, {eta} left" };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(Duration::from_millis(250));
    }
    let bar = bar.with_message(label.to_owned());
    let ticker = if is_quiet || is_drawn { None } else { ticker(bar.clone()) };
    Step { bar, begun: AtomicBool::new(false), ticker }
}

/// Says a line now and then where more is done: while one part takes long, the time left that the others tell only
/// grows.
fn ticker(bar: ProgressBar) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (stop, stopped) = channel();
    let thread = std::thread::Builder::new().spawn(move || {
        let mut last = None;
        while stopped.recv_timeout(BETWEEN_LINES) == Err(RecvTimeoutError::Timeout) {
            let now = Some((bar.message(), bar.position())).filter(|_| bar.length() != Some(0));
            if now.is_none() || now != last {
                line(&said(&bar));
            }
            last = now;
        }
    });
    thread.ok().map(|thread| (stop, thread))
}

fn said(bar: &ProgressBar) -> String {
    let (label, length) = (bar.message(), bar.length().unwrap_or(0));
    let (done, elapsed) = (bar.position(), bar.elapsed().as_secs_f64());
    if length == 0 {
        return format!("{label}: for {elapsed:.0} s now");
    }
    let left = match done {
        0 => String::new(),
        _ => format!(", about {:.0} s left", elapsed * length.saturating_sub(done) as f64 / done as f64),
    };
    format!("{label}: {done} of {length}{left}")
}

impl Step {
    /// So many more parts are done.
    pub fn inc(&self, parts: u64) {
        self.bar.inc(parts);
    }

    /// So many parts more than were thought of are to be done.
    pub fn lengthen(&self, parts: u64) {
        self.bar.inc_length(parts);
    }

    /// A part of this name begins, and the one before it is done.
    pub fn begin(&self, part: &str) {
        if self.begun.swap(true, Ordering::Relaxed) {
            self.inc(1);
        }
        self.bar.set_message(part.to_owned());
    }

    /// The step is over.
    pub fn finish_and_clear(self) {}
}

impl Drop for Step {
    fn drop(&mut self) {
        if let Some((stop, thread)) = self.ticker.take() {
            drop(stop);
            // It only prints; how it ended makes no difference.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}

/// A line on stderr that says what was done or left out.
pub fn note(message: impl AsRef<str>) {
    if !QUIET.load(Ordering::Relaxed) && is_new(message.as_ref()) {
        line(message.as_ref());
    }
}

/// A line on stderr that asks for attention.
pub fn warn(message: impl AsRef<str>) {
    if is_new(message.as_ref()) {
        let warning = format!("warning: {}", message.as_ref());
        match HELD.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            Some(held) => held.push(warning),
            None => line(&warning),
        }
    }
}

/// Holds warnings back from now on: the result comes first, or the error that they led to comes last.
pub fn hold_warnings() {
    HELD.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
}

/// Says the warnings that were held back, and others at once.
pub fn say_held() {
    let held = HELD.lock().unwrap_or_else(PoisonError::into_inner).take();
    held.iter().flatten().for_each(|warning| line(warning));
}

/// Whether nothing has said it yet: what was a note is no warning afterwards.
fn is_new(message: &str) -> bool {
    SAID.lock().unwrap_or_else(PoisonError::into_inner).insert(message.to_owned())
}

/// One write a line, so that lines of several threads don't mix.
fn line(text: &str) {
    let _ = std::io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_names_step_count_and_time_left() {
        let after_ten_seconds = |length: u64| {
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
            said(&bar.with_position(12).with_message("looking").with_elapsed(Duration::from_secs(10)))
        };
        assert_eq!(after_ten_seconds(60), "looking: 12 of 60, about 40 s left");
        assert_eq!(after_ten_seconds(0), "looking: for 10 s now");
    }
}

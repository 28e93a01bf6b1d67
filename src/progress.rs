//! What a person sees on stderr while a command runs: bars, notes and warnings.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar for a step of `length` equal parts; it draws nothing when stderr is not a terminal.
pub fn bar(label: &'static str, length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template("{msg:24} [{bar:32}] {pos}/{len} {eta:>6}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.with_message(label)
}

/// A line on stderr that says what was done or left out.
pub fn note(message: impl AsRef<str>) {
    eprintln!("{}", message.as_ref());
}

/// A line on stderr that asks for attention.
pub fn warn(message: impl AsRef<str>) {
    eprintln!("warning: {}", message.as_ref());
}

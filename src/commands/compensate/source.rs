//! The text of a program, with that of its data file behind it where points stand there.
//!
//! In: the program's file. Out: one text, in which a motion finds its points, and with other readings the bytes of both
//! files again.

use camino::{Utf8Path, Utf8PathBuf};

use crate::files;
use crate::programs::{self, Encoding, Joints, Language};

pub(super) struct Source {
    pub(super) text: String,
    encoding: Encoding,
    data: Option<Data>,
}

/// The data file, whose text stands behind the program's.
struct Data {
    path: Utf8PathBuf,
    encoding: Encoding,
    /// Where the program's text ends, and this one's begins.
    program: usize,
    from: usize,
    /// Lines before it.
    lines: u64,
}

impl Source {
    pub(super) fn read(path: &Utf8Path) -> files::Result<Source> {
        let bytes = files::read_text_bytes(path, "robot program", None)?;
        let Some((text, encoding)) = programs::decoded(bytes) else {
            let hint = Some("save it as UTF-8, or as the controller does");
            return Err(files::Error::format(path, None, "robot program: UTF-16 text".to_owned(), hint));
        };
        Ok(Source { text, encoding, data: None })
    }

    /// With the data file of this program behind it, where it stands beside it.
    pub(super) fn with_data(self, path: &Utf8Path) -> files::Result<Source> {
        let beside = ["dat", "DAT"].map(|ending| path.with_extension(ending));
        let Some(path) = beside.into_iter().find(|path| path.is_file()) else { return Ok(self) };
        let Source { text: data, encoding, .. } = Source::read(&path)?;
        let mut text = self.text;
        let program = text.len();
        if !text.ends_with('\n') {
            text.push('\n');
        }
        let lines = text.matches('\n').count() as u64;
        let beside = Data { path, encoding, program, from: text.len(), lines };
        text.push_str(&data);
        Ok(Source { text, encoding: self.encoding, data: Some(beside) })
    }

    pub(super) fn data_file(&self) -> Option<&Utf8Path> {
        self.data.as_ref().map(|data| data.path.as_path())
    }

    /// A line of the text in the file where it stands.
    pub(super) fn line(&self, line: u64) -> u64 {
        let before = self.data.as_ref().map_or(0, |data| data.lines);
        if line > before { line - before } else { line }
    }

    /// The files with other readings for some of their targets, the program's first; the data file where one of them
    /// stands there.
    pub(super) fn corrected<'a>(
        &'a self,
        program: &'a Utf8Path,
        (language, joints): (Language, Joints),
        changed: &[(&programs::Target, Vec<f64>)],
    ) -> Vec<(&'a Utf8Path, Vec<u8>)> {
        let with = |changed: &[_]| programs::with_readings(language, &self.text, joints, changed);
        let Some(data) = &self.data else { return vec![(program, self.encoding.encoded(&with(changed)))] };
        let (of_data, own): (Vec<_>, Vec<_>) = changed.iter().cloned().partition(|(t, _)| t.line > data.lines);
        let (text, behind) = (with(&own), self.text.len() - data.program);
        let mut files = vec![(program, self.encoding.encoded(&text[..text.len() - behind]))];
        if !of_data.is_empty() {
            files.push((data.path.as_path(), data.encoding.encoded(&with(&of_data)[data.from..])));
        }
        files
    }
}

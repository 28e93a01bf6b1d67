//! Files as the program reads and writes them: whole, atomically, with the path in every complaint.

use std::io::{Read, Write};

use camino::{Utf8Path, Utf8PathBuf};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::error::Category;

use super::fault::{decimal_comma, first_of_key, line_at, plain};
use super::kind::kind;
use super::missing::meant;
use crate::diagnostic::{Explain, Place};

/// Result of reading or writing a file.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Reading or writing a file failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{what} not found")]
    Missing {
        /// What was looked for.
        what: &'static str,
        path: Utf8PathBuf,
        /// What makes it.
        hint: Option<String>,
    },
    /// The operating system refused.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// "read", "write", "create", ...
        action: &'static str,
        /// The file or folder.
        path: Utf8PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It would take the place of a file that the run reads.
    #[error("{path} is read by this run and would be overwritten by it")]
    OverInput { path: Utf8PathBuf },
    /// It would take the place of a file that is not, as it stands, this program's.
    #[error("{path} is there already, and was not written by stereocal or was changed since")]
    OverForeign { path: Utf8PathBuf },
    /// The content is not what the format asks for.
    #[error("{message}")]
    Format {
        /// What was found and what was needed.
        message: String,
        place: Place,
        /// What to change.
        hint: Option<String>,
    },
}

impl Error {
    /// Of a file that is not what it must be; `hint` says what to change.
    pub fn format(path: &Utf8Path, line: Option<u64>, message: impl Into<String>, hint: Option<&str>) -> Error {
        let place = Place { path: path.to_owned(), line };
        Error::Format { message: message.into(), place, hint: hint.map(str::to_owned) }
    }

    /// The same error with another hint, where it has one: the command knows the flag that named the file.
    pub fn with_hint(self, new: &str) -> Error {
        let new = Some(new.to_owned());
        match self {
            Error::Missing { what, path, hint: Some(_) } => Error::Missing { what, path, hint: new },
            Error::Format { message, place, hint: Some(_) } => Error::Format { message, place, hint: new },
            other => other,
        }
    }
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::Missing { path, .. } => Some(path.to_string()),
            Error::Format { place, .. } => Some(place.to_string()),
            _ => None,
        }
    }
    fn hint(&self) -> Option<String> {
        match self {
            Error::Missing { path, hint, .. } => meant(path, hint.clone()),
            Error::Format { hint, .. } => hint.clone(),
            Error::Io { action, source, path } if source.kind() == std::io::ErrorKind::PermissionDenied => {
                Some(match *action {
                    "read" => format!("its owner can let you read it: `chmod -R u+rX {path}`"),
                    _ => "`--out DIR` names a folder that you may write into".to_owned(),
                })
            }
            Error::Io { .. } => None,
            Error::OverInput { .. } => Some("`--out DIR` names another folder".to_owned()),
            Error::OverForeign { .. } => {
                Some("`--out DIR` names another folder; `--force` replaces the file".to_owned())
            }
        }
    }
}

/// The largest settings, robot or calibration file, bytes. A calibration of 40 pairs with its covariance has 2 MB.
const MOST_TEXT_BYTES: u64 = 64 << 20;

/// Reads a text file; `what` names it in the message when it is not there, `hint` says what makes it.
pub fn read_text(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<String> {
    let not_text = |_| Error::format(path, None, format!("{what}: not UTF-8 text"), None);
    String::from_utf8(read_text_bytes(path, what, hint)?).map_err(not_text)
}

/// Reads a text file in whatever encoding; one that is too long is never read to its end.
pub fn read_text_bytes(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(MOST_TEXT_BYTES + 1).read_to_end(&mut bytes));
    match read {
        Ok(_) if bytes.len() as u64 > MOST_TEXT_BYTES => {
            let message = format!("{what}: more than {} MB of text; no such file is that long", MOST_TEXT_BYTES >> 20);
            Err(Error::format(path, None, message, None))
        }
        Ok(_) => Ok(bytes),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => {
            Err(Error::Missing { what, path: path.to_owned(), hint: hint.map(str::to_owned) })
        }
        Err(source) => Err(unreadable(path, what, source)),
    }
}

/// A file that is there and cannot be read; of a folder what it holds, as one of its files is meant.
pub fn unreadable(path: &Utf8Path, what: &'static str, source: std::io::Error) -> Error {
    const NAMED: usize = 4;
    const READ: [&str; 11] = ["csv", "tsv", "txt", "xlsx", "xls", "ods", "json", "toml", "yaml", "yml", "urdf"];
    if source.kind() != std::io::ErrorKind::IsADirectory {
        return Error::Io { action: "read", path: path.to_owned(), source };
    }
    let files = path.read_dir_utf8().into_iter().flatten().flatten().filter(|entry| {
        entry.path().is_file() && entry.path().extension().is_some_and(|ending| READ.contains(&ending))
    });
    // First the files of the kind that is most likely meant.
    let likely: &[&str] = match what {
        "robot file" => &["toml", "urdf"],
        _ if what.contains("calibration") => &["json", "yaml", "yml"],
        _ => &["csv", "xlsx"],
    };
    let rank = |path: &Utf8Path| likely.iter().position(|e| path.extension() == Some(*e)).unwrap_or(likely.len());
    let mut all: Vec<(usize, String)> =
        files.map(|entry| (rank(entry.path()), format!("`{}`", entry.path()))).collect();
    all.sort();
    let names = all.iter().take(NAMED).map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(", ");
    let hint = match all.len() {
        0 => "name a file; this folder holds none that is read".to_owned(),
        count if count <= NAMED => format!("name a file in it: {names}"),
        count => format!(
            "name a file in it: {names} and {} more; of files that hold a pose each make one table first, a row a pose",
            count - NAMED
        ),
    };
    Error::format(path, None, format!("{what}: this is a folder, and a file is needed"), Some(&hint))
}

pub fn read_json<T: DeserializeOwned>(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<T> {
    let text = read_text(path, what, hint)?;
    let is_json = text.trim_start().starts_with(['{', '[']);
    serde_json::from_str(&text).map_err(|e| match (is_json, kind(&text)) {
        (false, Some(other)) => Error::format(path, None, format!("{what}: this is no JSON, but {other}"), hint),
        (false, None) => Error::format(path, None, format!("{what}: this is no JSON"), hint),
        (true, Some(other)) if !what.split(' ').any(|word| other.split(' ').any(|own| own == word)) => {
            Error::format(path, None, format!("{what}: this is {other}"), hint)
        }
        (true, _) => {
            let fault = match e.classify() {
                Category::Eof => "it ends in the middle: the file is not whole".to_owned(),
                Category::Syntax => "what stands here is no JSON".to_owned(),
                Category::Data | Category::Io => plain(&e.to_string()),
            };
            Error::format(path, Some(e.line() as u64), format!("{what}: {fault}"), hint)
        }
    })
}

pub fn read_toml<T: DeserializeOwned>(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<T> {
    let text = read_text(path, what, hint)?;
    if text.trim_start().starts_with('{') {
        return Err(Error::format(path, None, format!("{what}: this is JSON, and TOML is needed"), hint));
    }
    toml::from_str(&text).map_err(|e| {
        if let Some(other @ "a table") = kind(&text) {
            return Error::format(path, None, format!("{what}: this is {other}, and TOML is needed"), hint);
        }
        let line = e.span().map(|span| line_at(&text, span.start));
        // Some messages do not say which key it is.
        let key = e.span().and_then(|span| text.get(span)).filter(|key| !key.is_empty() && key.len() < 40);
        let key = key.filter(|key| !e.message().contains(['`', '"']) && !key.contains('\n'));
        let first = key.zip(e.span()).and_then(|(key, span)| first_of_key(&text, key, span.start));
        let first = first.map_or(String::new(), |first| format!(", which stands in line {first} already"));
        let key = key.map_or(String::new(), |key| format!(": `{key}`{first}"));
        if let Some(fault) = line.and_then(|line| decimal_comma(text.lines().nth(line as usize - 1)?)) {
            return Error::format(path, line, format!("{what}: {fault}"), None);
        }
        Error::format(path, line, format!("{what}: {}{key}", plain(e.message())), None)
    })
}

/// Indented JSON with a final newline. Numbers that are not finite become `null`.
pub fn to_json<T: Serialize>(value: &T) -> String {
    // Serialisation of this crate's plain structs (string keys, no I/O) has no way to fail.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"));
    text.push('\n');
    text
}

/// Whether a file must survive a power cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// It must: file and folder are flushed to the disk before the call returns.
    Synced,
    /// It can be made again.
    Unsynced,
}

/// How the names of files begin that are being written.
pub(super) const TEMPORARY: &str = ".stereocal-";

/// Whether a file of this name was being written.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY)
}

/// Writes a file whole or not at all, making its folder where needed: to a temporary name beside it, then renamed.
pub fn write_atomically(path: &Utf8Path, bytes: &[u8], durability: Durability) -> Result<()> {
    let io = |source| Error::Io { action: "write", path: path.to_owned(), source: without_path(source) };
    let folder = path.parent().filter(|folder| !folder.as_str().is_empty()).unwrap_or(Utf8Path::new("."));
    std::fs::create_dir_all(folder).map_err(io)?;
    let mut builder = tempfile::Builder::new();
    // Temporary files are private by default; results are meant to be read by colleagues (the umask still applies).
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.prefix(TEMPORARY).tempfile_in(folder).map_err(io)?;
    file.write_all(bytes).map_err(io)?;
    if durability == Durability::Synced {
        file.as_file().sync_all().map_err(io)?;
    }
    file.persist(path).map_err(|e| io(e.error))?;
    if durability == Durability::Synced {
        sync_folder(folder).map_err(io)?;
    }
    Ok(())
}

/// The system's reason alone: a temporary file's name is nothing that a person knows.
pub fn without_path(error: std::io::Error) -> std::io::Error {
    let told = error.raw_os_error().is_none() && error.kind().to_string() != "uncategorized error";
    if told && error.kind() != std::io::ErrorKind::Other { error.kind().into() } else { error }
}

/// Flushes the renaming itself. Not every file system has an operation for that, and not every folder may be opened.
fn sync_folder(folder: &Utf8Path) -> std::io::Result<()> {
    use std::io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    match std::fs::File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(e) if matches!(e.kind(), InvalidInput | PermissionDenied | Unsupported) => Ok(()),
        done => done,
    }
}

/// A folder for a test, gone with the first of what is returned.
#[cfg(test)]
pub fn temporary_folder() -> (tempfile::TempDir, Utf8PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = Utf8PathBuf::from_path_buf(folder.path().to_owned()).unwrap();
    (folder, path)
}

/// A file of this content in such a folder.
#[cfg(test)]
pub fn temporary(name: &str, content: impl AsRef<[u8]>) -> (tempfile::TempDir, Utf8PathBuf) {
    let (folder, path) = temporary_folder();
    let path = path.join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_temporary_name_is_not_told() {
        let refused = tempfile::NamedTempFile::new_in("/nowhere at all").unwrap_err();
        assert!(refused.to_string().contains("nowhere"));
        assert!(!without_path(refused).to_string().contains("nowhere"));
    }

    #[test]
    fn a_folder_in_place_of_a_file_is_answered_with_the_files_in_it() {
        let (_keep, path) = temporary_folder();
        let said = || read_text(&path, "robot file", None).unwrap_err();
        assert!(said().to_string().contains("this is a folder") && said().hint().unwrap().contains("holds none"));
        std::fs::write(path.join("robot.toml"), "").unwrap();
        assert_eq!(said().hint().unwrap(), format!("name a file in it: `{path}/robot.toml`"));
        for pose in 0..6 {
            std::fs::write(path.join(format!("pose_{pose}.txt")), "").unwrap();
        }
        let hint = said().hint().unwrap();
        assert!(hint.contains("pose_2.txt` and 3 more; ") && hint.ends_with("one table first, a row a pose"), "{hint}");
        // Of each kind that it may be, that one first.
        std::fs::write(path.join("table.csv"), "").unwrap();
        let of_table = read_text(&path, "measurements file", None).unwrap_err().hint().unwrap();
        assert!(of_table.starts_with(&format!("name a file in it: `{path}/table.csv`")), "{of_table}");
        let hint = said().hint().unwrap();
        assert!(hint.starts_with(&format!("name a file in it: `{path}/robot.toml`")), "{hint}");
    }

    #[test]
    fn what_may_not_be_read_is_answered_with_what_lets_it_be() {
        let refused =
            |action| Error::Io { action, path: "x".into(), source: std::io::ErrorKind::PermissionDenied.into() };
        assert!(refused("read").hint().is_some_and(|hint| hint.contains("chmod -R u+rX x")));
        assert!(refused("write").hint().is_some_and(|hint| hint.contains("--out DIR")));
    }
}

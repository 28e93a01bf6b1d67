//! Files as the program reads and writes them: whole, atomically, with the path in every complaint.

use std::io::Write;

use camino::{Utf8Path, Utf8PathBuf};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{Explain, Place, Result};

/// Reading or writing a file failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// It is not there.
    #[error("{what} not found")]
    Missing {
        /// What was looked for.
        what: &'static str,
        /// Where.
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
    /// The content is not what the format asks for.
    #[error("{message}")]
    Format {
        /// What was found and what was needed.
        message: String,
        /// Where.
        place: Place,
        /// What to change.
        hint: Option<String>,
    },
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::Missing { path, .. } => Some(path.to_string()),
            Error::Io { .. } => None,
            Error::Format { place, .. } => Some(place.to_string()),
        }
    }
    fn hint(&self) -> Option<String> {
        match self {
            Error::Missing { hint, .. } | Error::Format { hint, .. } => hint.clone(),
            Error::Io { .. } => None,
        }
    }
}

/// Reads a text file; `what` names it in the message when it is not there, `hint` says what makes it.
pub fn read_text(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<String> {
    match std::fs::read(path) {
        Ok(bytes) => String::from_utf8(bytes).map_err(|_| {
            Error::Format {
                message: format!("{what}: not UTF-8 text"),
                place: Place { path: path.to_owned(), line: None },
                hint: None,
            }
            .into()
        }),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => {
            Err(Error::Missing { what, path: path.to_owned(), hint: hint.map(str::to_owned) }.into())
        }
        Err(source) => Err(Error::Io { action: "read", path: path.to_owned(), source }.into()),
    }
}

/// Reads a JSON file.
pub fn read_json<T: DeserializeOwned>(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<T> {
    let text = read_text(path, what, hint)?;
    serde_json::from_str(&text).map_err(|e| {
        Error::Format {
            message: format!("{what}: {e}"),
            place: Place { path: path.to_owned(), line: Some(e.line() as u64) },
            hint: None,
        }
        .into()
    })
}

/// Reads a TOML file.
pub fn read_toml<T: DeserializeOwned>(path: &Utf8Path, what: &'static str, hint: Option<&str>) -> Result<T> {
    let text = read_text(path, what, hint)?;
    toml::from_str(&text).map_err(|e| {
        let line = e.span().map(|span| 1 + text[..span.start.min(text.len())].matches('\n').count() as u64);
        Error::Format {
            message: format!("{what}: {}", e.message()),
            place: Place { path: path.to_owned(), line },
            hint: None,
        }
        .into()
    })
}

/// The folder that a command writes into. Opening it creates it and proves it writable, so that a long run
/// doesn't end in "permission denied".
#[derive(Debug, Clone)]
pub struct OutDir {
    path: Utf8PathBuf,
}

impl OutDir {
    /// Creates the folder where needed and checks that a file can be made in it.
    pub fn open(path: &Utf8Path) -> Result<OutDir> {
        let io = |action, source| Error::Io { action, path: path.to_owned(), source };
        std::fs::create_dir_all(path).map_err(|e| io("create", e))?;
        tempfile::NamedTempFile::new_in(path).map_err(|e| io("write into", e))?;
        Ok(OutDir { path: path.to_owned() })
    }

    /// The path of a file in the folder.
    pub fn join(&self, name: &str) -> Utf8PathBuf {
        self.path.join(name)
    }

    /// The folder itself.
    pub fn path(&self) -> &Utf8Path {
        &self.path
    }

    /// Writes a file whole or not at all: to a temporary name beside it, then renamed. `name` may hold folders.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_atomically(&self.path.join(name), bytes)
    }

    /// Writes indented JSON with a final newline.
    pub fn write_json<T: Serialize>(&self, name: &str, value: &T) -> Result<()> {
        self.write(name, to_json(value).as_bytes())
    }
}

/// Indented JSON with a final newline. Numbers that are not finite become `null`.
pub fn to_json<T: Serialize>(value: &T) -> String {
    // Serialisation of this crate's plain structs (string keys, no I/O) has no way to fail.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"));
    text.push('\n');
    text
}

/// Writes a file whole or not at all, making its folder where needed.
pub fn write_atomically(path: &Utf8Path, bytes: &[u8]) -> Result<()> {
    let io = |source| Error::Io { action: "write", path: path.to_owned(), source };
    let folder = match path.parent() {
        Some(folder) if !folder.as_str().is_empty() => folder,
        _ => Utf8Path::new("."),
    };
    std::fs::create_dir_all(folder).map_err(io)?;
    let mut file =
        tempfile::Builder::new().prefix(".stereocal-").permissions_like_others().tempfile_in(folder).map_err(io)?;
    file.write_all(bytes).map_err(io)?;
    file.persist(path).map_err(|e| io(e.error))?;
    Ok(())
}

trait PermissionsLikeOthers {
    fn permissions_like_others(&mut self) -> &mut Self;
}

impl PermissionsLikeOthers for tempfile::Builder<'_, '_> {
    /// Temporary files are private by default; results are meant to be read by colleagues (the umask still applies).
    fn permissions_like_others(&mut self) -> &mut Self {
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            self.permissions(std::fs::Permissions::from_mode(0o666));
        }
        self
    }
}

//! The folder that a command writes into.
//!
//! One run at a time writes into it (a lock that the system drops with the process). A file is written whole or not at
//! all. A file that the run reads is never overwritten; one that stands there and is not, byte for byte, what this
//! program wrote, only by `--force`. What was written is remembered in `.stereocal/written.sha256`, in the form of
//! `sha256sum`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use camino::{Utf8Path, Utf8PathBuf};
use serde::Serialize;

use super::io::{Durability, Error, Result, TEMPORARY, is_temporary, to_json, without_path, write_atomically};
use super::provenance::{Digested, KEY, Provenance, Run, pictures, sha256};
use crate::progress;

/// Endings of files that are written: no folder is meant by such a name.
const RESULTS: [&str; 12] =
    ["toml", "json", "csv", "html", "yaml", "yml", "pdf", "svg", "png", "urdf", "cameramodel", "txt"];

/// The program's own folder in a results folder.
const OWN: &str = ".stereocal";

/// What was written, and when it was as it stands.
const WRITTEN: &str = ".stereocal/written.sha256";

/// The folder that a command writes into. Opening it creates it and proves it writable, so that a long run
/// doesn't end in "permission denied".
#[derive(Debug)]
pub struct OutDir {
    path: Utf8PathBuf,
    force: bool,
    inputs: Vec<PathBuf>,
    state: Mutex<State>,
    /// Held until the end; `None` where the file system knows no locks.
    lock: Option<File>,
}

#[derive(Debug, Default)]
struct State {
    provenance: Option<Provenance>,
    /// Folders of pictures that are not yet among the provenance's inputs, with their places there.
    folders: Vec<(usize, Utf8PathBuf)>,
    /// Hashes of the pictures that were read.
    pictures: BTreeMap<Utf8PathBuf, String>,
    /// Hashes by name. More than one where a run was killed between writing here and renaming the file.
    written: BTreeMap<String, BTreeSet<String>>,
    log: Option<File>,
    swept: BTreeSet<Utf8PathBuf>,
}

/// The path of an earlier command's result: in this folder where it is there, else in the one where results usually
/// are.
pub fn or_usual(folder: &Utf8Path, name: &str, usual: &Utf8Path) -> Utf8PathBuf {
    let (here, usual) = (folder.join(name), usual.join(name));
    if here.is_file() || !usual.is_file() { here } else { usual }
}

impl OutDir {
    /// Creates the folder where needed, checks that a file can be made in it, and waits for other runs that write into
    /// it.
    pub fn open(path: &Utf8Path) -> Result<OutDir> {
        if !path.is_dir() && (path.is_file() || path.extension().is_some_and(|e| RESULTS.contains(&e))) {
            let hint = "`--out DIR` names the folder; `--out .` is the one that you are in";
            let message = "results go into a folder, and this is the name of a file";
            return Err(Error::format(path, None, message, Some(hint)));
        }
        let io = |action, source| Error::Io { action, path: path.to_owned(), source };
        std::fs::create_dir_all(path).map_err(|e| io("create", e))?;
        let probe = tempfile::Builder::new().prefix(TEMPORARY).tempfile_in(path);
        probe.map_err(|e| io("write into", without_path(e)))?;
        std::fs::create_dir_all(path.join(OWN)).map_err(|e| io("write into", e))?;
        let lock = lock(path);
        let log =
            File::options().append(true).create(true).open(path.join(WRITTEN)).map_err(|e| io("write into", e))?;
        let written = std::fs::read_to_string(path.join(WRITTEN)).map_or_else(|_| BTreeMap::new(), |text| parse(&text));
        let state = State { written, log: Some(log), ..State::default() };
        Ok(OutDir { path: path.to_owned(), force: false, inputs: Vec::new(), state: Mutex::new(state), lock })
    }

    /// Whether a run has written its results here.
    pub fn is_at(path: &Utf8Path) -> bool {
        path.join(OWN).is_dir()
    }

    /// Remembers what the run was asked for and what it reads: those files will not be overwritten, and every JSON file
    /// says what it was made of. An input that is not there is left to its reader to complain of.
    pub fn for_run(mut self, run: &Run, inputs: &[&Utf8Path]) -> OutDir {
        self.force = run.force;
        let mut provenance = run.command.clone().map(Provenance::new);
        let mut folders = Vec::new();
        for path in run.inputs.iter().map(Utf8PathBuf::as_path).chain(inputs.iter().copied()) {
            let files = if path.is_dir() { pictures(path) } else { vec![path.to_owned()] };
            self.inputs.extend(files.iter().filter_map(|file| file.as_std_path().canonicalize().ok()));
            let Some(provenance) = &mut provenance else { continue };
            match Digested::read(path) {
                Some(digested) => provenance.inputs.push(digested),
                // Pictures are hashed as they are read.
                None if path.is_dir() => folders.push((provenance.inputs.len() + folders.len(), path.to_owned())),
                None => (),
            }
        }
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        (state.provenance, state.folders) = (provenance, folders);
        self
    }

    /// Remembers the hash of what was read from a picture.
    pub fn picture_read(&self, path: &Utf8Path, hash: &str) {
        self.state().pictures.insert(path.to_owned(), hash.to_owned());
    }

    /// The hash of what this run has read from a picture.
    pub fn hash_of_picture(&self, path: &Utf8Path) -> Option<String> {
        self.state().pictures.get(path).cloned()
    }

    /// The path of a file in the folder.
    pub fn join(&self, name: &str) -> Utf8PathBuf {
        self.path.join(name)
    }

    /// See [`or_usual`].
    pub fn or_usual(&self, name: &str, usual: &Utf8Path) -> Utf8PathBuf {
        or_usual(&self.path, name, usual)
    }

    /// The folder itself.
    pub fn path(&self) -> &Utf8Path {
        &self.path
    }

    /// What this run has read and written so far; `None` where no provenance is wanted.
    pub fn provenance(&self) -> Option<Provenance> {
        let (folders, known) = {
            let mut state = self.state();
            (std::mem::take(&mut state.folders), state.pictures.clone())
        };
        // Not under the lock: pictures that nobody has read are hashed by all threads.
        let digested: Vec<_> = folders.iter().map(|(at, path)| (at, Digested::folder(path, &known))).collect();
        let mut state = self.state();
        if let Some(Provenance { inputs, .. }) = &mut state.provenance {
            // One that could not be read leaves those after it a place too far.
            digested
                .into_iter()
                .filter_map(|(at, folder)| Some((at, folder?)))
                .for_each(|(at, folder)| inputs.insert((*at).min(inputs.len()), folder));
        }
        state.provenance.clone()
    }

    /// Says how the measurements were made that this run reads.
    pub fn measured_by(&self, measured_by: Provenance) {
        if let Some(provenance) = &mut self.state().provenance {
            provenance.measured_by = Some(Box::new(measured_by));
        }
    }

    /// Whether a file of the folder is one that this run reads.
    pub fn is_input(&self, name: &str) -> bool {
        self.join(name).as_std_path().canonicalize().is_ok_and(|path| self.inputs.contains(&path))
    }

    /// An error where one of these files must not be written: better now than after the work.
    pub fn check_free(&self, names: &[&str]) -> Result<()> {
        names.iter().try_for_each(|name| self.permit(name, None))
    }

    /// Writes a file whole or not at all. `name` may hold folders.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let digested = Digested::written(name, bytes);
        self.permit(name, Some(&digested.sha256))?;
        let path = self.join(name);
        {
            let mut state = self.state();
            self.sweep(&mut state, &path);
            let line = format!("{}  {}\n", digested.sha256, one_line(name));
            // Remembered before it is renamed into place: a run that is killed between leaves no file that it does not
            // know.
            let io = |source| Error::Io { action: "write", path: path.clone(), source };
            state.log.as_mut().map_or(Ok(()), |log| log.write_all(line.as_bytes())).map_err(io)?;
            state.written.entry(one_line(name)).or_default().insert(digested.sha256.clone());
        }
        write_atomically(&path, bytes, Durability::Synced)?;
        let mut state = self.state();
        state.written.insert(one_line(name), BTreeSet::from([digested.sha256.clone()]));
        // Pictures are written by many threads, in no order, and there are thousands of them.
        if let Some(provenance) = state.provenance.as_mut().filter(|_| !name.ends_with(".png")) {
            provenance.outputs.push(digested);
        }
        Ok(())
    }

    /// Writes a file that the program can make again, such as an entry of the cache: neither protected nor remembered.
    pub fn write_scratch(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_atomically(&self.join(name), bytes, Durability::Unsynced)
    }

    /// Writes indented JSON with a final newline, its provenance last, and returns its text.
    pub fn write_json<T: Serialize>(&self, name: &str, value: &T) -> Result<String> {
        let text = match (serde_json::to_value(value), serde_json::to_value(self.provenance())) {
            (Ok(serde_json::Value::Object(mut object)), Ok(provenance)) if !provenance.is_null() => {
                object.insert(KEY.to_owned(), provenance);
                to_json(&object)
            }
            _ => to_json(value),
        };
        self.write(name, text.as_bytes())?;
        Ok(text)
    }

    /// Writes a TOML file, its provenance as comments before it.
    pub fn write_toml(&self, name: &str, text: &str) -> Result<()> {
        let mut comments = String::new();
        if let Some(provenance) = self.provenance() {
            let mut say = |line: String| comments.push_str(&format!("# {}\n", one_line(&line)));
            say(format!("{}, {}", provenance.program, provenance.date));
            say(provenance.command);
            for made_of in provenance.inputs {
                say(format!("made of {}, sha256 {}", made_of.file, made_of.sha256));
            }
        }
        self.write(name, format!("{comments}{text}").as_bytes())
    }

    /// Whether a file may be written; `sha256` is that of what would be written, where known.
    fn permit(&self, name: &str, sha256_new: Option<&str>) -> Result<()> {
        let path = self.join(name);
        let Ok(standing) = path.as_std_path().canonicalize() else { return Ok(()) };
        if self.inputs.contains(&standing) {
            return Err(Error::OverInput { path });
        }
        if self.force {
            return Ok(());
        }
        let bytes =
            std::fs::read(&standing).map_err(|source| Error::Io { action: "replace", path: path.clone(), source })?;
        let hash = sha256(&bytes);
        let ours = self.state().written.get(&one_line(name)).is_some_and(|known| known.contains(&hash));
        if ours || sha256_new == Some(&hash) { Ok(()) } else { Err(Error::OverForeign { path }) }
    }

    /// Removes what runs left behind that were killed while they wrote beside `path`. No other run writes now.
    fn sweep(&self, state: &mut State, path: &Utf8Path) {
        let Some(folder) = path.parent().filter(|folder| self.lock.is_some() && !state.swept.contains(*folder)) else {
            return;
        };
        state.swept.insert(folder.to_owned());
        for entry in folder.read_dir_utf8().into_iter().flatten().flatten() {
            if is_temporary(entry.file_name()) && entry.path().is_file() {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change of the state is complete in itself.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for OutDir {
    /// Brings the list of files into order: the same run leaves the same list, whichever thread wrote first.
    fn drop(&mut self) {
        let path = self.join(WRITTEN);
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        let lines = |(name, hashes): (&String, &BTreeSet<String>)| -> String {
            hashes.iter().map(|hash| format!("{hash}  {name}\n")).collect()
        };
        let text: String = state.written.iter().map(lines).collect();
        state.log = None;
        // What was appended says the same, if not in order.
        let _ = write_atomically(&path, text.as_bytes(), Durability::Unsynced);
    }
}

/// The lock of a results folder, once it is free.
fn lock(path: &Utf8Path) -> Option<File> {
    let file = File::options().write(true).create(true).truncate(false).open(path.join(OWN).join("lock")).ok()?;
    match file.try_lock() {
        Ok(()) => Some(file),
        Err(TryLockError::WouldBlock) => {
            progress::note(format!("waiting: another run writes into {path}"));
            file.lock().ok().map(|()| file)
        }
        Err(TryLockError::Error(_)) => None,
    }
}

fn parse(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut written: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (hash, name) in text.lines().filter_map(|line| line.split_once("  ")) {
        written.entry(name.to_owned()).or_default().insert(hash.to_owned());
    }
    written
}

/// A name that fits on a line.
fn one_line(name: &str) -> String {
    name.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::temporary_folder;

    #[test]
    fn own_files_are_replaced_and_changed_ones_are_not() {
        let (_keep, path) = temporary_folder();
        OutDir::open(&path).unwrap().write("a/x.csv", b"1").unwrap();
        let out = OutDir::open(&path).unwrap();
        out.write("a/x.csv", b"2").unwrap();
        out.write("a/x.csv", b"3").unwrap();
        drop(out);
        std::fs::write(path.join("a/x.csv"), "4").unwrap();
        let out = OutDir::open(&path).unwrap();
        assert!(matches!(out.check_free(&["a/x.csv"]), Err(Error::OverForeign { .. })));
        assert!(matches!(out.write("a/x.csv", b"5"), Err(Error::OverForeign { .. })));
        out.write("a/x.csv", b"4").unwrap();
        drop(out);
        std::fs::write(path.join("a/x.csv"), "6").unwrap();
        let out = OutDir::open(&path).unwrap().for_run(&Run { force: true, ..Run::default() }, &[]);
        out.write("a/x.csv", b"7").unwrap();
        assert_eq!(std::fs::read(path.join("a/x.csv")).unwrap(), b"7");
    }

    #[test]
    fn what_a_killed_run_left_is_swept_away() {
        let (_keep, path) = temporary_folder();
        std::fs::write(path.join(".stereocal-abcdef"), "half").unwrap();
        OutDir::open(&path).unwrap().write("x", b"1").unwrap();
        assert!(!path.join(".stereocal-abcdef").exists());
    }

    #[test]
    fn json_says_what_it_was_made_of() {
        let (_keep, path) = temporary_folder();
        std::fs::write(path.join("in.csv"), "a").unwrap();
        let run = Run { command: Some("stereocal x".to_owned()), ..Run::default() };
        let out = OutDir::open(&path).unwrap().for_run(&run, &[&path.join("in.csv"), &path.join("not there")]);
        out.write("first.csv", b"b").unwrap();
        let text = out.write_json("y.json", &BTreeMap::from([("fx", 0.1)])).unwrap();
        let provenance = Provenance::of_json(&path.join("y.json")).unwrap();
        assert!(text.starts_with("{\n  \"fx\": 0.1,\n  \"provenance\": {"), "{text}");
        assert_eq!(provenance.inputs[0].sha256, sha256(b"a"));
        assert_eq!(provenance.outputs[0].file, "first.csv");
    }
}

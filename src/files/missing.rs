//! What was likely meant by the name of a file or folder that is not there.

use camino::{Utf8Path, Utf8PathBuf};

use crate::diagnostic::slips;

/// The hint of something missing: what there is that may be meant, before what else the hint says.
pub fn meant(path: &Utf8Path, hint: Option<String>) -> Option<String> {
    let there = in_results(path).or_else(|| mistyped(path));
    let there = there.map(|there| format!("there is {there}: is it meant?"));
    let said: Vec<String> = there.into_iter().chain(hint).collect();
    (!said.is_empty()).then(|| said.join(" "))
}

/// What has this name in the folder that results go to unless another is named.
fn in_results(path: &Utf8Path) -> Option<Utf8PathBuf> {
    let there = Utf8Path::new("out").join(path.file_name()?);
    (there != path && there.is_file()).then_some(there)
}

/// What there is where the first name of the path that is not there has few letters wrong: what has fewest.
fn mistyped(path: &Utf8Path) -> Option<Utf8PathBuf> {
    let missing = path.ancestors().take_while(|part| !part.as_str().is_empty() && !part.exists()).last()?;
    let rest = path.strip_prefix(missing).ok()?;
    let name = missing.file_name()?.to_lowercase();
    let folder = missing.parent()?;
    let listed = if folder.as_str().is_empty() { Utf8Path::new(".") } else { folder };
    let near = |entry: std::io::Result<camino::Utf8DirEntry>| {
        let own = entry.ok()?.file_name().to_owned();
        let there = folder.join(&own).components().chain(rest.components()).collect::<Utf8PathBuf>();
        let wrong = slips(&name, &own.to_lowercase()).filter(|_| !own.starts_with('.') && there.exists())?;
        Some((wrong, there))
    };
    listed.read_dir_utf8().ok()?.filter_map(near).min().map(|(_, there)| there)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::temporary_folder;

    #[test]
    fn the_nearest_name_beside_is_told_and_no_other() {
        let (_keep, folder) = temporary_folder();
        std::fs::create_dir_all(folder.join("images/left")).unwrap();
        for name in ["poses_1.csv", "poses_12.csv", ".images", "a"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        for (typed, there) in [
            ("imgaes", Some("images")),
            ("Images/left", Some("images/left")),
            ("image/left", Some("images/left")),
            ("image/right", None),
            ("image/left/1.png", None),
            ("pose_1.csv", Some("poses_1.csv")),
            ("robot.toml", None),
            ("b", None),
            ("pictures", None),
        ] {
            let there = there.map(|name| format!("there is {}: is it meant? x", folder.join(name)));
            assert_eq!(meant(&folder.join(typed), Some("x".into())), there.or(Some("x".into())), "{typed}");
        }
        assert_eq!(meant(&folder.join("none/at/all"), None), None);
    }
}

//! Videos, which are no pictures: what takes pictures out of them.

use camino::Utf8Path;

/// Endings of videos, in small letters.
const ENDINGS: [&str; 8] = ["mp4", "avi", "mov", "mkv", "webm", "m4v", "mpg", "wmv"];

/// How pictures come out of this file, where its name is that of a video.
pub fn hint(file: &Utf8Path) -> Option<String> {
    let ending = file.extension()?.to_ascii_lowercase();
    ENDINGS.contains(&ending.as_str()).then(|| {
        format!(
            "`mkdir left; ffmpeg -i {file} -vf fps=1 left/%03d.png` takes pictures out of a video, and those of the other camera go into right/; \
             two videos seldom begin at one moment: the board must stand still"
        )
    })
}

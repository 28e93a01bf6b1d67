//! Folders of pictures as they come: broken files, other boards, hidden boards, and a second run on the same pictures.
#![allow(clippy::unwrap_used, reason = "a test ends where its files are not as they should be")]

use std::path::{Path, PathBuf};

use crate::run::{stderr, stdout, stereocal, workplace};

/// The repository's own pairs, in a folder that may be spoilt.
fn copied(folder: &Path) -> PathBuf {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("calib_images");
    let to = folder.join("pictures");
    for side in ["left", "right"] {
        std::fs::create_dir_all(to.join(side)).unwrap();
        for entry in std::fs::read_dir(from.join(side)).unwrap() {
            let path = entry.unwrap().path();
            std::fs::copy(&path, to.join(side).join(path.file_name().unwrap())).unwrap();
        }
    }
    to
}

/// Exit status and all that was said.
fn check(folder: &Path, more: &[&str]) -> (Option<i32>, String) {
    let arguments = [&["camera-check", "pictures", "--lens", "radial2"], more].concat();
    let output = stereocal(folder, &arguments);
    (output.status.code(), stderr(&output) + &stdout(&output))
}

#[test]
fn broken_pictures_are_skipped_with_their_reasons() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let whole = std::fs::read(pictures.join("left/01.png")).unwrap();
    std::fs::write(pictures.join("left/01.png"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(pictures.join("left/02.png"), b"").unwrap();
    std::fs::write(pictures.join("right/03.png"), b"this is a text").unwrap();
    image::GrayImage::new(64, 64).save(pictures.join("right/04.png")).unwrap();
    // Part of the board behind a hand: the other corners are used.
    let mut hidden = image::open(pictures.join("left/05.png")).unwrap().to_luma8();
    let (w, h) = hidden.dimensions();
    for y in 9 * h / 20..11 * h / 20 {
        for x in 9 * w / 20..11 * w / 20 {
            hidden.put_pixel(x, y, image::Luma([90]));
        }
    }
    hidden.save(pictures.join("left/05.png")).unwrap();
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    for reason in ["pair 01 is not used: left", "pair 02 is not used: left", "pair 03", "pair 04", "64x64"] {
        assert!(said.contains(reason), "{reason} is not in: {said}");
    }
    assert!(!said.contains("pair 05 is not used"), "{said}");
    let corners = std::fs::read_to_string(folder.path().join("out/corners.csv")).unwrap();
    let left = corners.lines().filter(|line| line.starts_with("05,left")).count();
    assert!((200..361).contains(&left), "{left}");
}

#[test]
fn a_second_run_reads_what_the_first_found_and_survives_a_torn_file() {
    let folder = workplace();
    copied(folder.path());
    let corners = || std::fs::read(folder.path().join("out/corners.csv")).unwrap();
    let (status, said) = check(folder.path(), &["--draw"]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    assert!(folder.path().join("out/overlays/01.png").is_file());
    let first = corners();
    let entries: Vec<PathBuf> =
        std::fs::read_dir(folder.path().join("out/cache")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(entries.len(), 20);
    let entry = std::fs::read(&entries[0]).unwrap();
    std::fs::write(&entries[0], &entry[..entry.len() / 2]).unwrap();
    check(folder.path(), &[]);
    assert_eq!(first, corners());
    assert_eq!(std::fs::read(&entries[0]).unwrap(), entry);
}

#[test]
fn another_size_of_board_is_named() {
    let folder = workplace();
    let pictures = copied(folder.path());
    for name in 3..=10 {
        for side in ["left", "right"] {
            std::fs::remove_file(pictures.join(side).join(format!("{name:02}.png"))).unwrap();
        }
    }
    let (status, said) = check(folder.path(), &["--squares", "19x19"]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("--squares 20x20"), "{said}");
}

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

/// Gives a picture of one pair to another, and the other way round.
fn exchange(pictures: &Path, one: &str, other: &str) {
    let aside = pictures.join("aside");
    std::fs::rename(pictures.join(one), &aside).unwrap();
    std::fs::rename(pictures.join(other), pictures.join(one)).unwrap();
    std::fs::rename(aside, pictures.join(other)).unwrap();
}

#[test]
fn mixed_up_pictures_are_named_as_what_they_are() {
    let folder = workplace();
    let pictures = copied(folder.path());
    exchange(&pictures, "left/02.png", "right/02.png");
    exchange(&pictures, "right/05.png", "right/07.png");
    image::open(pictures.join("right/04.png")).unwrap().rotate180().save(pictures.join("right/04.png")).unwrap();
    for side in ["left", "right"] {
        std::fs::copy(pictures.join(side).join("09.png"), pictures.join(side).join("11.png")).unwrap();
    }
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    for (pair, reason) in [
        ("02", "left and right picture are exchanged"),
        ("04", "the right picture is turned by 180 degrees"),
        ("05", "taken at the same time as the right one of pair 07"),
        ("07", "taken at the same time as the right one of pair 05"),
        ("11", "the same pictures as pair 09"),
    ] {
        let line = said.lines().find(|line| line.contains(&format!("pair {pair} is not used")));
        assert!(line.is_some_and(|line| line.contains(reason)), "{pair}, {reason}: {said}");
    }
    assert!(said.contains("6 of 11 pairs"), "{said}");
}

#[test]
fn exchanged_folders_are_a_rig_and_said() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let straight = check(folder.path(), &[]);
    assert!(!straight.1.contains("are left and right exchanged"), "{}", straight.1);
    exchange(&pictures, "left", "right");
    let exchanged = check(folder.path(), &[]);
    assert_eq!(straight.0, exchanged.0);
    assert!(exchanged.1.contains("are left and right exchanged"), "{}", exchanged.1);
}

#[test]
fn a_board_in_a_larger_or_smaller_one_is_named() {
    let folder = workplace();
    copied(folder.path());
    for wrong in ["18x12", "22x21"] {
        let (status, said) = check(folder.path(), &["--squares", wrong]);
        assert_eq!(status, Some(2), "{said}");
        assert!(said.contains("hint: `--squares 20x20`"), "{wrong}: {said}");
    }
}

#[test]
fn files_that_are_no_pictures_are_said_to_be_none() {
    let folder = workplace();
    for side in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("pictures").join(side)).unwrap();
        for name in ["1.png", "2.png", "3.pgm", "4.pgm", "5.jpg"] {
            // What a header promises must not be believed: ten thousand million pixels.
            let bytes: &[u8] = if name.ends_with("pgm") { b"P5 100000 100000 255\n" } else { b"GIF89a" };
            std::fs::write(folder.path().join("pictures").join(side).join(name), bytes).unwrap();
        }
    }
    let (status, said) = check(folder.path(), &[]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("3: both pictures: cannot be decoded") && said.contains("hint: save the pictures"), "{said}");
}

//! Folders that must be read, folders that must not, and what is said of both.

use camino::{Utf8Path, Utf8PathBuf};

use super::{PairBy, Pairing, Source};
use crate::files::temporary_folder;
use crate::imaging::Result;

/// A folder with empty files of these names.
pub fn folder<S: AsRef<str>>(names: &[S]) -> (tempfile::TempDir, Utf8PathBuf) {
    let (keep, path) = temporary_folder();
    for name in names {
        let file = path.join(name.as_ref());
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, "").unwrap();
    }
    (keep, path)
}

/// The folder read by itself.
pub fn read(path: &Utf8Path, by: Option<PairBy>) -> Result<Pairing> {
    Source { by, ..Source::folder("camera-check", path) }.whole_pictures()
}

fn pairing(of: &[&str]) -> Pairing {
    let (_keep, path) = folder(of);
    read(&path, None).unwrap_or_else(|e| panic!("{of:?}: {}", crate::diagnostic::report(&e)))
}

fn names(of: &[&str]) -> Vec<String> {
    pairing(of).pairs.into_iter().map(|p| p.pair).collect()
}

/// The refusal, with the folder's own path taken out.
fn complaint(of: &[&str], by: Option<PairBy>) -> String {
    let (_keep, path) = folder(of);
    let said = read(&path, by).map(|p| p.taken).unwrap_err();
    crate::diagnostic::report(&said).replace(path.as_str(), "IMAGES")
}

#[test]
fn every_way_of_naming() {
    assert_eq!(names(&["left/10.png", "right/10.PNG", "left/2.tif", "right/2.tiff"]), ["2", "10"]);
    assert_eq!(names(&["Left/left1.png", "Right/right1.png"]), ["1"]);
    assert_eq!(names(&["left01.jpg", "right01.jpg", "left_02.jpg", "right_02.jpg"]), ["01", "02"]);
    assert_eq!(names(&["a_left.png", "a_right.png"]), ["a"]);
    assert_eq!(names(&["a_L.png", "a_R.png", "b_l.png", "b_r.png"]), ["a", "b"]);
    assert_eq!(names(&["left.png", "right.png"]), ["left-right"]);
}

#[test]
fn what_is_left_out_is_said() {
    let text = pairing(&["left1.png", "right1.png", "left2.png", "board.png", "notes.txt", "signal.png"]);
    assert_eq!(
        text.left_out().unwrap(),
        "left out: 1 picture without a partner (left2.png); 2 pictures whose names tell neither left nor right; \
         1 other file"
    );
}

#[test]
fn what_was_taken_is_said() {
    let sets: [(&[&str], &str); 6] = [
        (
            &[
                "stereoLeft/imageL9.png",
                "stereoLeft/imageL10.png",
                "stereoRight/imageR9.png",
                "stereoRight/imageR10.png",
            ],
            "2 pairs by name: left stereoLeft/imageL*.png, right stereoRight/imageR*.png",
        ),
        (
            &["cam1/b00.jpg", "cam1/b01.jpg", "cam2/a00.jpg", "cam2/a01.jpg"],
            "2 pairs by number: left cam1/b*.jpg, right cam2/a*.jpg; no word tells left from right: the first by name is left",
        ),
        (&["left/7.png", "right/7.jpg"], "1 pair by name: left left/7.png, right right/7.jpg"),
        (
            &["left/1.png", "left/2.jpg", "right/1.png", "right/2.png", "board.png"],
            "2 pairs by name: left left/*, right right/*.png; not taken: ./ (1 picture)",
        ),
        (
            &["left/1.png", "left/rest/2.png", "right/1.png", "right/rest/2.png"],
            "1 pair by name: left left/1.png, right right/1.png; not taken: left/rest/ (1 picture), right/rest/ (1 picture)",
        ),
        (
            &["original/1.png", "stereoLeft/1.png", "stereoRight/1.png"],
            "1 pair by name: left stereoLeft/1.png, right stereoRight/1.png; not taken: original/ (1 picture)",
        ),
    ];
    for (files, said) in sets {
        assert_eq!(pairing(files).taken, said);
    }
}

#[test]
fn names_that_contradict_their_folders_are_said() {
    let exchanged = pairing(&["left/right1.png", "left/right2.png", "right/left1.png", "right/left2.png"]);
    assert!(exchanged.pairs[0].left.as_str().ends_with("left/right1.png"));
    assert!(exchanged.taken.ends_with("; the names of the pictures say it the other way round"), "{}", exchanged.taken);
    assert!(!pairing(&["left/left1.png", "right/right1.png"]).taken.contains("other way"));
}

#[test]
fn what_lies_beside_pictures_does_not_mislead() {
    let files = [
        "left/2.png",
        "left/10.png",
        "left/Thumbs.db",
        "left/.hidden.png",
        "left/._10.png",
        "left/2.xml",
        "right/2.png",
        "right/10.png",
        "right/calib.yml",
        "right/notes.txt",
        "preview.png",
        "left/raw/2.png",
        "__MACOSX/left/._2.png",
    ];
    let found = pairing(&files);
    assert_eq!(found.pairs.iter().map(|p| p.pair.as_str()).collect::<Vec<_>>(), ["2", "10"]);
    assert_eq!(found.left_out().unwrap(), "left out: 4 other files");
}

#[test]
fn results_of_a_former_run_are_no_pictures() {
    let files = [
        "cam1/1.png",
        "cam1/2.png",
        "cam2/1.png",
        "cam2/2.png",
        "out/.stereocal/lock",
        "out/rectified/left/1.png",
        "out/rectified/left/2.png",
        "out/rectified/right/1.png",
        "out/rectified/right/2.png",
        "out/overlays/1.png",
    ];
    assert!(pairing(&files).taken.contains("left cam1/*.png, right cam2/*.png"));
}

#[test]
fn names_of_pairs_are_their_own_and_in_natural_order() {
    assert_eq!(names(&["l/image10.png", "r/image10.png", "l/image2.png", "r/image2.png"]), ["image2", "image10"]);
    assert_eq!(names(&["cam1/b2.jpg", "cam2/a2.jpg", "cam1/b10.jpg", "cam2/a10.jpg"]), ["2", "10"]);
    assert_eq!(names(&["cam1/b02.jpg", "cam2/a2.jpg", "cam1/b1.jpg", "cam2/a01.jpg"]), ["1", "2"]);
    assert_eq!(names(&["left/l07.png", "right/r07.png"]), ["07"]);
    // What is left of both names is the same for both pairs: they keep the left picture's name.
    assert_eq!(names(&["L/a_l1.png", "R/a_r1.png", "L/a_l_1.png", "R/a_r_1.png"]), ["a_l1", "a_l_1"]);
}

#[test]
fn numbers_pair_where_names_do_not() {
    assert_eq!(names(&["L/IMG_0001.JPG", "R/DSC_1.JPG", "L/IMG_0002.JPG", "R/DSC_2.JPG"]), ["1", "2"]);
    let stamps = ["L/WIN_20210304_11_22_33_Pro.jpg", "L/WIN_20210304_11_23_33_Pro.jpg"];
    let other = ["R/WIN_20210304_11_22_34_Pro.jpg", "R/WIN_20210304_11_24_33_Pro.jpg"];
    // Seconds that agree by chance pair nothing.
    let said = complaint(&[stamps, other].concat(), None);
    assert!(said.contains("no pair found: 4 pictures") && said.contains("IMAGES --pair-by order`"), "{said}");
    let (_keep, path) = folder(&[stamps, other].concat());
    let ordered = read(&path, Some(PairBy::Order)).unwrap();
    assert_eq!(ordered.pairs[1].right.file_name(), Some("WIN_20210304_11_24_33_Pro.jpg"));
    assert_eq!(ordered.taken.split(':').next(), Some("2 pairs by order"));
}

#[test]
fn a_second_naming_pairs_what_the_first_leaves_over() {
    let series = |side: usize| (0..9).map(move |n| format!("cam{side}/image{side}_{n}.png"));
    let lone = ["cam0/2.bmp", "cam0/3.bmp", "cam0/Image1.bmp", "cam1/2.bmp", "cam1/8.bmp"].map(str::to_owned);
    let (_keep, path) = folder(&series(0).chain(series(1)).chain(lone).collect::<Vec<_>>());
    for by in [None, Some(PairBy::Number)] {
        let found = read(&path, by).unwrap();
        assert_eq!((found.pairs.len(), found.pairs[0].pair.as_str()), (10, "2"), "{found:?}");
        assert_eq!(found.taken.split(':').next(), Some("10 pairs by number"));
        assert_eq!(found.left_out().unwrap(), "left out: 3 pictures without a partner (Image1.bmp, 3.bmp, 8.bmp)");
    }
    let by_name = read(&path, Some(PairBy::Name)).unwrap();
    assert_eq!((by_name.pairs.len(), by_name.single.len()), (1, 21));
    // Names that pair most come before numbers, which pair what these leave over.
    let named = ["p1", "p2", "p3"].map(|name| [format!("a/{name}.png"), format!("b/{name}.png")]);
    let counted = [7, 8].map(|n| [format!("a/x0_{n}.png"), format!("b/x1_{n}.png")]);
    let files = [named.concat(), counted.concat()].concat();
    let both = pairing(&files.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(both.taken.split(':').next(), Some("5 pairs by name and number"));
    // One number of one name says nothing.
    let chance = pairing(&["a/p1.png", "b/p1.png", "a/p2.png", "b/p2.png", "a/x4_7.png", "b/x5_7.png"]);
    assert_eq!((chance.pairs.len(), chance.single.len()), (2, 2));
}

#[test]
fn order_needs_equal_counts() {
    let said = complaint(&["cam1/a.png", "cam1/b.png", "cam2/c.png"], Some(PairBy::Order));
    assert!(said.contains("2 left pictures and 1 right ones cannot be paired in their order"), "{said}");
    assert!(said.contains("cam1/: 2 pictures (a.png, b.png)") && said.contains("cam2/: 1 picture (c.png)"), "{said}");
}

#[test]
fn unequal_counts_pair_by_name_and_say_what_is_alone() {
    let found = pairing(&["cam0/1.png", "cam0/2.png", "cam0/3.png", "cam1/1.png", "cam1/3.png"]);
    assert_eq!(found.pairs.len(), 2);
    assert_eq!(found.left_out().unwrap(), "left out: 1 picture without a partner (2.png)");
}

#[test]
fn one_number_twice_is_refused() {
    let said = complaint(&["cam1/1_a.png", "cam1/1_b.png", "cam2/1_c.png", "cam2/2_d.png"], None);
    assert!(said.contains("two pictures claim the same side of pair `1`") && said.contains("1_b.png"), "{said}");
}

#[test]
fn of_two_formats_of_one_name_the_one_without_loss_is_read() {
    let found = pairing(&["left_1.jpg", "left_1.png", "right_1.PNG", "right_1.jpeg", "left_2.bmp", "right_2.jpg"]);
    let files: Vec<[&str; 2]> =
        found.pairs.iter().map(|p| [&p.left, &p.right].map(|path| path.file_name().unwrap())).collect();
    assert_eq!(files, [["left_1.png", "right_1.PNG"], ["left_2.bmp", "right_2.jpg"]]);
    assert_eq!(found.left_out().unwrap(), "left out: 2 pictures in another format beside others of the same names");
}

#[test]
fn folders_without_pairs_say_what_they_hold() {
    assert!(complaint(&[] as &[&str], None).contains("there are no pictures here"));
    let said = complaint(&["left.mp4", "right.mp4"], None);
    assert!(said.contains("but 2 other files (left.mp4, ...)") && said.contains("ffmpeg -i "), "{said}");
    let said = complaint(&["left/a.HEIC", "right/a.HEIC"], None);
    assert!(
        said.contains("but 2 other files (a.HEIC, ...)") && said.contains("save pictures of other formats"),
        "{said}"
    );
    let said = complaint(&["left/a.png", "rigth/a.png"], None);
    assert!(said.contains("left/ but no right/") && said.contains("camera-check IMAGES/left IMAGES/rigth`"), "{said}");
    let said = complaint(&["left/a.png", "cam2/a.png"], None);
    assert!(said.contains("camera-check IMAGES/left IMAGES/cam2`"), "{said}");
    // Without numbers or equal names nothing says what belongs together.
    assert!(complaint(&["left/a.png", "right/b.png"], None).contains("2 pictures have no partner"));
    let said = complaint(&["board.png", "scene.png"], None);
    assert!(
        said.contains("neither left nor right") && said.contains("./: 2 pictures (board.png, scene.png)"),
        "{said}"
    );
    assert!(said.contains("`stereocal camera-check LEFT RIGHT`"), "{said}");
    let missing = crate::diagnostic::report(&read(Utf8Path::new("/no/such/folder"), None).unwrap_err());
    assert!(missing.contains("not found") && missing.contains("/no/such/folder"), "{missing}");
}

#[test]
fn pictures_that_may_hold_both_views_are_said_to() {
    let said = complaint(&["raw/view_001.png", "raw/view_002.png", "raw/view_003.png"], None);
    assert!(said.contains("holds both views, `--side-by-side` or `--top-bottom` cuts it in two"), "{said}");
}

#[test]
fn more_than_one_reading_is_refused_with_each() {
    let sets = [1, 2].map(|set| ["left1", "left2", "right1", "right2"].map(|name| format!("{set}/{name}.jpg")));
    let (_keep, path) = folder(&sets.concat());
    let said = crate::diagnostic::report(&read(&path, None).unwrap_err()).replace(path.as_str(), "IMAGES");
    assert!(said.contains("can be read in 2 ways"), "{said}");
    assert!(said.contains("2 pairs by name: left 2/left*.jpg, right 2/right*.jpg"), "{said}");
    assert!(said.contains("`stereocal camera-check IMAGES/1`, or `stereocal camera-check IMAGES/2`"), "{said}");

    let said = complaint(&["cam0/1.png", "cam1/1.png", "cam2/1.png"], None);
    assert!(said.contains("in 3 ways") && said.contains("camera-check IMAGES/cam0 IMAGES/cam2`"), "{said}");

    let said = complaint(&["wide/1.png", "tele/1.png", "board/1.png"], None);
    assert!(said.contains("which of these 3 folders are left and right is not told"), "{said}");
    assert!(said.contains("board/: 1 picture (1.png)"), "{said}");

    // A grid of two positions with two repetitions: either may be the camera.
    let said = complaint(&["p1_1.png", "p1_2.png", "p2_1.png", "p2_2.png"], None);
    assert!(said.contains("in 2 ways") && said.contains("into a folder of its own"), "{said}");

    // One pair beside two folders with more.
    let said =
        complaint(&["left.png", "right.png", "stereoL/1.png", "stereoL/2.png", "stereoR/1.png", "stereoR/2.png"], None);
    assert!(said.contains("in 2 ways") && said.contains("IMAGES/stereoL IMAGES/stereoR`"), "{said}");
}

#[test]
fn many_folders_are_not_compared_with_each_other() {
    let files: Vec<String> = (0..200).flat_map(|k| (0..3).map(move |n| format!("set{k}/{n}.png"))).collect();
    let (_keep, path) = folder(&files);
    let said = crate::diagnostic::report(&read(&path, None).unwrap_err());
    assert!(said.contains("which of these 200 folders") && said.contains("and 192 more folders"), "{said}");
}

#[test]
fn pictures_of_one_camera_are_no_pairs() {
    for files in [
        ["left/1.png", "left_corners/1.png", "left/2.png", "left_corners/2.png"],
        ["a/left_1.png", "b/left_1.png", "a/left_2.png", "b/left_2.png"],
        ["raw/left_1.png", "drawn/1.png", "raw/left_2.png", "drawn/2.png"],
        ["WIN_20210304_11_22_33_Pro.jpg", "WIN_20210304_11_22_35_Pro.jpg", "WIN_20210304_11_23_31_Pro.jpg", "1.jpg"],
        ["colour_1.png", "colour_2.png", "colour_3.png", "rl_1.png"],
        ["leftover_1.png", "leftover_2.png", "bright_1.png", "bright_2.png"],
    ] {
        let (_keep, path) = folder(&files);
        let found = read(&path, None);
        assert!(found.is_err(), "{files:?}: {}", found.unwrap().taken);
    }
}

#[test]
fn a_folder_may_hold_one_pair() {
    let found = pairing(&["pair_2/left.png", "pair_2/right.png", "pair_10/left.png", "pair_10/right.png"]);
    assert_eq!(found.pairs.iter().map(|p| p.pair.as_str()).collect::<Vec<_>>(), ["pair_2", "pair_10"]);
    assert_eq!(found.taken, "2 pairs by name: left pair_*/left.png, right pair_*/right.png");
    assert_eq!(names(&["001/cam_L.png", "001/cam_R.png", "002/cam_L.png", "002/cam_R.png"]), ["001", "002"]);
    // Many folders with two pictures each are no cameras; a few may be.
    for two in [["im0", "im1"], ["view_a", "view_b"], ["10", "9"]] {
        let files: Vec<String> = (1..=5).flat_map(|k| two.map(|name| format!("scene{k}/{name}.png"))).collect();
        let (_keep, path) = folder(&files);
        let found = read(&path, None).unwrap_or_else(|e| panic!("{two:?}: {}", crate::diagnostic::report(&e)));
        assert_eq!(
            found.pairs.iter().map(|p| p.pair.as_str()).collect::<Vec<_>>(),
            ["scene1", "scene2", "scene3", "scene4", "scene5"]
        );
        let left = if two[0] == "10" { "9.png" } else { &format!("{}.png", two[0]) };
        assert!(found.pairs[0].left.as_str().ends_with(left), "{}", found.taken);
        assert!(found.taken.ends_with("no word tells left from right: the first by name is left"), "{}", found.taken);
        assert!(complaint(&files[..8].iter().map(String::as_str).collect::<Vec<_>>(), None).contains("ways"));
    }
    // Two cameras with two pictures each are no two pairs of folders.
    assert_eq!(names(&["cam1/1.png", "cam1/2.png", "cam2/1.png", "cam2/2.png"]), ["1", "2"]);
    let said = complaint(&["a/left.png", "a/right.png", "b/left.png", "b/right.png", "b/top.png"], None);
    assert!(said.contains("in 2 ways"), "{said}");
}

#[test]
fn two_folders_are_given_in_their_order() {
    let (_keep, path) = folder(&["z/b1.png", "z/b2.png", "a/raw/1.png", "a/raw/2.png", "out/x.txt", "f.json"]);
    let (z, a, out, file) = (path.join("z"), path.join("a"), path.join("out"), path.join("f.json"));
    let of = |images, right| Source { right: Some(right), ..Source::folder("measure", images) }.whole_pictures();
    let found = of(&z, &a).unwrap();
    assert_eq!(found.pairs[0].left, z.join("b1.png"));
    assert_eq!(found.pairs[0].right, a.join("raw/1.png"));
    let said = format!("2 pairs by number: left {z}/b*.png, right {a}/raw/*.png");
    assert_eq!(found.taken, said);
    let said = |right| crate::diagnostic::report(&of(&z, right).unwrap_err());
    assert!(said(&out).contains("there are no pictures here"), "{}", said(&out));
    assert!(said(&file).contains("this is a file") && said(&file).contains("--out"), "{}", said(&file));
    assert!(crate::diagnostic::report(&of(&z, &z).unwrap_err()).contains("the same folder"));
    let nowhere = path.join("nowhere");
    assert!(said(&nowhere).contains("folder not found") && said(&nowhere).contains("`--out"), "{}", said(&nowhere));
}

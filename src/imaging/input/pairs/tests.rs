//! Folders that must be read, folders that must not, and what is said of both.

use camino::{Utf8Path, Utf8PathBuf};

use super::{PairBy, Pairing, Source};
use crate::files::temporary_folder;

/// All names that patterns stand for: `{1,2}` for each of a list, `{1..9}` for each number of a range, `␣` for a blank.
/// Patterns are a blank apart.
pub fn expanded(patterns: &str) -> Vec<String> {
    patterns.split(' ').flat_map(|pattern| names_of(&pattern.replace('␣', " "))).collect()
}

fn names_of(pattern: &str) -> Vec<String> {
    let Some((before, rest)) = pattern.split_once('{') else { return vec![pattern.to_owned()] };
    let (inside, after) = rest.split_once('}').unwrap();
    let choices: Vec<String> = match inside.split_once("..") {
        Some((first, last)) => {
            let (from, to): (usize, usize) = (first.parse().unwrap(), last.parse().unwrap());
            let width = if first.starts_with('0') && first.len() > 1 { first.len() } else { 1 };
            (from..=to).map(|n| format!("{n:0width$}")).collect()
        }
        None => inside.split(',').map(str::to_owned).collect(),
    };
    let rest = names_of(after);
    choices.iter().flat_map(|choice| rest.iter().map(move |rest| format!("{before}{choice}{rest}"))).collect()
}

/// A folder with empty files of these names.
pub fn folder(names: &[String]) -> (tempfile::TempDir, Utf8PathBuf) {
    let (keep, path) = temporary_folder();
    for name in names {
        let file = path.join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, "").unwrap();
    }
    (keep, path)
}

/// The folder read by itself, or the refusal with the folder's own path taken out.
pub fn outcome(path: &Utf8Path, by: Option<PairBy>) -> Result<Pairing, String> {
    let found = Source { by, ..Source::folder("camera-check", path) }.whole_pictures();
    found.map_err(|e| crate::diagnostic::report(&e).replace(path.as_str(), "IMAGES"))
}

fn pairing(of: &str) -> Pairing {
    let (_keep, path) = folder(&expanded(of));
    outcome(&path, None).unwrap_or_else(|said| panic!("{of}: {said}"))
}

/// The names of the pairs, a blank apart.
fn names(of: &str) -> String {
    pairing(of).pairs.iter().map(|p| p.pair.as_str()).collect::<Vec<_>>().join(" ")
}

fn complaint(of: &str, by: Option<PairBy>) -> String {
    let (_keep, path) = folder(&expanded(of));
    outcome(&path, by).map(|found| found.taken).unwrap_err()
}

#[test]
fn every_way_of_naming() {
    for (files, pairs) in [
        ("left/10.png right/10.PNG left/2.tif right/2.tiff", "2 10"),
        ("Left/left1.png Right/right1.png", "1"),
        ("{left,right}01.jpg {left,right}_02.jpg", "01 02"),
        ("a_{left,right}.png", "a"),
        ("a_{L,R}.png b_{l,r}.png", "a b"),
        ("{left,right}.png", "left-right"),
        // Names of pairs are their own and in natural order.
        ("{l,r}/image{10,2}.png", "image2 image10"),
        ("cam1/b{2,10}.jpg cam2/a{2,10}.jpg", "2 10"),
        ("cam1/b{02,1}.jpg cam2/a{2,01}.jpg", "1 2"),
        ("left/l07.png right/r07.png", "07"),
        // What is left of both names is the same for both pairs: they keep the left picture's name.
        ("L/a_l1.png R/a_r1.png L/a_l_1.png R/a_r_1.png", "a_l1 a_l_1"),
        ("L/IMG_000{1,2}.JPG R/DSC_{1,2}.JPG", "1 2"),
        ("00{1,2}/cam_{L,R}.png", "001 002"),
        // Two cameras with two pictures each are no two pairs of folders.
        ("cam{1,2}/{1,2}.png", "1 2"),
    ] {
        assert_eq!(names(files), pairs, "{files}");
    }
}

#[test]
fn what_is_left_out_is_said() {
    for (files, pairs, said) in [
        (
            "{left,right}1.png left2.png board.png notes.txt signal.png",
            "1",
            "1 picture without a partner (left2.png); 2 pictures whose names tell neither left nor right; 1 other file",
        ),
        ("cam0/{1,2,3}.png cam1/{1,3}.png", "1 3", "1 picture without a partner (2.png)"),
        (
            "cam0/{1,2,3b,4}.png cam1/{1,2,3,4}.png",
            "1 2 4",
            "2 pictures without a partner (3.png, 3b.png), as many on each side: `--pair-by order` pairs all in the order of their names",
        ),
        // One is missing on either side: in their order all pictures between these would be another pair's.
        ("cam0/{1,2,3}.png cam1/{2,3,4}.png", "2 3", "2 pictures without a partner (1.png, 4.png)"),
        // What lies beside pictures does not mislead.
        (
            "left/{2,10}.png left/Thumbs.db left/.hidden.png left/._10.png left/2.xml right/{2,10}.png right/calib.yml \
             right/notes.txt preview.png left/raw/2.png __MACOSX/left/._2.png",
            "2 10",
            "4 other files",
        ),
    ] {
        assert_eq!((names(files).as_str(), pairing(files).left_out()), (pairs, Some(format!("left out: {said}"))));
    }
}

#[test]
fn what_was_taken_is_said() {
    for (files, said) in [
        (
            "stereoLeft/imageL{9,10}.png stereoRight/imageR{9,10}.png",
            "2 pairs by name: left stereoLeft/imageL*.png, right stereoRight/imageR*.png",
        ),
        (
            "cam1/b{00,01}.jpg cam2/a{00,01}.jpg",
            "2 pairs by number: left cam1/b*.jpg, right cam2/a*.jpg; no word tells left from right: the first by name is left",
        ),
        ("left/7.png right/7.jpg", "1 pair by name: left left/7.png, right right/7.jpg"),
        (
            "left/1.png left/2.jpg right/{1,2}.png board.png",
            "2 pairs by name: left left/*, right right/*.png; not taken: ./ (1 picture)",
        ),
        (
            "{left,right}/1.png {left,right}/rest/2.png",
            "1 pair by name: left left/1.png, right right/1.png; not taken: left/rest/ (1 picture), right/rest/ (1 picture)",
        ),
        (
            "original/1.png stereo{Left,Right}/1.png",
            "1 pair by name: left stereoLeft/1.png, right stereoRight/1.png; not taken: original/ (1 picture)",
        ),
        // Names that contradict their folders.
        (
            "left/right{1,2}.png right/left{1,2}.png",
            "2 pairs by name: left left/right*.png, right right/left*.png; the names of the pictures say it the other way round",
        ),
        ("left/left1.png right/right1.png", "1 pair by name: left left/left1.png, right right/right1.png"),
        // Results of a former run are no pictures.
        (
            "cam{1,2}/{1,2}.png out/.stereocal/lock out/rectified/{left,right}/{1,2}.png out/overlays/1.png",
            "2 pairs by name: left cam1/*.png, right cam2/*.png; no word tells left from right: the first by name is left",
        ),
    ] {
        assert_eq!(pairing(files).taken, said);
    }
}

#[test]
fn numbers_pair_where_names_do_not() {
    // Seconds that agree by chance pair nothing.
    let stamps = "L/WIN_20210304_11_{22,23}_33_Pro.jpg R/WIN_20210304_11_{22_34,24_33}_Pro.jpg";
    let said = complaint(stamps, None);
    assert!(said.contains("no pair found: 4 pictures") && said.contains("IMAGES --pair-by order`"), "{said}");
    let (_keep, path) = folder(&expanded(stamps));
    let ordered = outcome(&path, Some(PairBy::Order)).unwrap();
    assert_eq!(ordered.pairs[1].right.file_name(), Some("WIN_20210304_11_24_33_Pro.jpg"));
    assert_eq!(ordered.taken.split(':').next(), Some("2 pairs by order"));
}

#[test]
fn numbers_of_a_name_keep_the_zeros_that_both_sides_write() {
    let stamps = "{L/front,R/side}-{03112022091500-0,03112022091502-07,03112022091504-11}.png";
    assert_eq!(names(stamps), "03112022091500_0 03112022091502_07 03112022091504_11");
    // Written with zeros on one side only it is still one number.
    assert_eq!(names("L/p007_x01.png L/p008_x02.png R/q7_y1.png R/q8_y2.png"), "7_1 8_2");
}

#[test]
fn a_second_naming_pairs_what_the_first_leaves_over() {
    let series = "cam0/image0_{0..8}.png cam1/image1_{0..8}.png";
    let (_keep, path) = folder(&expanded(&format!("{series} cam0/{{2,3,Image1}}.bmp cam1/{{2,8}}.bmp")));
    for by in [None, Some(PairBy::Number)] {
        let found = outcome(&path, by).unwrap();
        assert_eq!((found.pairs.len(), found.pairs[0].pair.as_str()), (10, "2"), "{found:?}");
        assert_eq!(found.taken.split(':').next(), Some("10 pairs by number"));
        assert_eq!(found.left_out().unwrap(), "left out: 3 pictures without a partner (Image1.bmp, 3.bmp, 8.bmp)");
    }
    let by_name = outcome(&path, Some(PairBy::Name)).unwrap();
    assert_eq!((by_name.pairs.len(), by_name.single.len()), (1, 21));
    // Names that pair most come before numbers, which pair what these leave over.
    let both = pairing("{a,b}/p{1,2,3}.png a/x0_{7,8}.png b/x1_{7,8}.png");
    assert_eq!(both.taken.split(':').next(), Some("5 pairs by name and number"));
    // One number of one name says nothing.
    let chance = pairing("{a,b}/p{1,2}.png a/x4_7.png b/x5_7.png");
    assert_eq!((chance.pairs.len(), chance.single.len()), (2, 2));
}

#[test]
fn of_two_formats_of_one_name_the_one_without_loss_is_read() {
    let found = pairing("left_1.jpg left_1.png right_1.PNG right_1.jpeg left_2.bmp right_2.jpg");
    let files: Vec<[&str; 2]> =
        found.pairs.iter().map(|p| [&p.left, &p.right].map(|path| path.file_name().unwrap())).collect();
    assert_eq!(files, [["left_1.png", "right_1.PNG"], ["left_2.bmp", "right_2.jpg"]]);
    assert_eq!(found.left_out().unwrap(), "left out: 2 pictures in another format beside others of the same names");
}

#[test]
fn folders_without_pairs_say_what_they_hold() {
    let order = Some(PairBy::Order);
    // Words of the refusal, two blanks apart.
    for (files, by, words) in [
        ("{left,right}.mp4", None, "but 2 other files (left.mp4, ...)  ffmpeg -i "),
        ("{left,right}/a.HEIC", None, "but 2 other files (a.HEIC, ...)  save pictures of other formats"),
        ("{left,rigth}/a.png", None, "left/ but no right/  camera-check IMAGES/left IMAGES/rigth`"),
        ("{left,cam2}/a.png", None, "camera-check IMAGES/left IMAGES/cam2`"),
        // Without numbers or equal names nothing says what belongs together.
        ("left/a.png right/b.png", None, "2 pictures have no partner"),
        (
            "board.png scene.png",
            None,
            "neither left nor right  ./: 2 pictures (board.png, scene.png)  `stereocal camera-check LEFT RIGHT`",
        ),
        ("raw/view_00{1,2,3}.png", None, "holds both views, `--side-by-side` or `--top-bottom` cuts it in two"),
        ("cam1/1_{a,b}.png cam2/1_c.png cam2/2_d.png", None, "two pictures claim the same side of pair `1`  1_b.png"),
        (
            "cam1/{a,b}.png cam2/c.png",
            order,
            "2 left pictures and 1 right ones cannot be paired in their order  cam1/: 2 pictures (a.png, b.png)  cam2/: 1 picture (c.png)",
        ),
        // More than one reading is refused with each.
        (
            "{1,2}/{left,right}{1,2}.jpg",
            None,
            "can be read in 2 ways  2 pairs by name: left 2/left*.jpg, right 2/right*.jpg  \
             `stereocal camera-check IMAGES/1`, or `stereocal camera-check IMAGES/2`",
        ),
        ("cam{0,1,2}/1.png", None, "in 3 ways  camera-check IMAGES/cam0 IMAGES/cam2`"),
        (
            "{wide,tele,board}/1.png",
            None,
            "which of these 3 folders are left and right is not told  board/: 1 picture (1.png)",
        ),
        ("left/{1,2}.png right/x.txt", None, "right/ holds no pictures  camera-check LEFT RIGHT`"),
        ("right/{1,2}.png left/x.txt", None, "left/ holds no pictures"),
        // Neither holds one: nothing is missing on one side.
        ("left/x.txt right/x.txt", None, "there are no pictures here"),
        // A grid of two positions with two repetitions: either may be the camera.
        ("p{1,2}_{1,2}.png", None, "in 2 ways  into a folder of its own"),
        // One pair beside two folders with more.
        ("{left,right}.png stereo{L,R}/{1,2}.png", None, "in 2 ways  IMAGES/stereoL IMAGES/stereoR`"),
        ("{a,b}/{left,right}.png b/top.png", None, "in 2 ways"),
        // Many folders are not compared with each other.
        ("set{0..199}/{0,1,2}.png", None, "which of these 200 folders  and 192 more folders"),
    ] {
        let said = complaint(files, by);
        assert!(words.split("  ").all(|word| said.contains(word)), "{files}: {said}");
    }
    let (_keep, empty) = folder(&[]);
    let nothing = outcome(&empty, None).unwrap_err();
    assert!(nothing.contains("there are no pictures here"), "{nothing}");
    let missing = outcome(Utf8Path::new("/no/such/folder"), None).unwrap_err();
    assert!(missing.contains("not found") && missing.contains("in: IMAGES"), "{missing}");
}

#[test]
fn pictures_of_one_camera_are_no_pairs() {
    for files in [
        "{left,left_corners}/{1,2}.png",
        "{a,b}/left_{1,2}.png",
        "raw/left_{1,2}.png drawn/{1,2}.png",
        "WIN_20210304_11_{22_33,22_35,23_31}_Pro.jpg 1.jpg",
        "colour_{1,2,3}.png rl_1.png",
        "leftover_{1,2}.png bright_{1,2}.png",
    ] {
        let (_keep, path) = folder(&expanded(files));
        assert!(outcome(&path, None).is_err(), "{files}");
    }
}

#[test]
fn a_folder_may_hold_one_pair() {
    let two = "pair_{2,10}/{left,right}.png";
    assert_eq!(names(two), "pair_2 pair_10");
    assert_eq!(pairing(two).taken, "2 pairs by name: left pair_*/left.png, right pair_*/right.png");
    // Many folders with two pictures each are no cameras; a few may be.
    for (two, left) in [("im0,im1", "im0.png"), ("view_a,view_b", "view_a.png"), ("10,9", "9.png")] {
        let many = format!("scene{{1..5}}/{{{two}}}.png");
        assert_eq!(names(&many), "scene1 scene2 scene3 scene4 scene5");
        let found = pairing(&many);
        assert!(found.pairs[0].left.as_str().ends_with(&format!("/{left}")), "{}", found.taken);
        assert!(found.taken.ends_with("no word tells left from right: the first by name is left"), "{}", found.taken);
        assert!(complaint(&many.replace("1..5", "1..4"), None).contains("ways"));
    }
}

#[test]
fn two_folders_are_given_in_their_order() {
    let (_keep, path) = folder(&expanded("z/b{1,2}.png a/raw/{1,2}.png out/x.txt f.json"));
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

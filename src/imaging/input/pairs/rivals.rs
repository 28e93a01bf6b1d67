//! Folders in which more than one set of pairs lies: which gives way to another, and which are refused with each other.

use super::tests::{expanded, folder};
use super::{PairBy, Source};

/// What is taken of a folder for so many pairs, or the refusal; the folder's own path is taken out.
fn said(files: &str, needed: usize, by: Option<PairBy>) -> Result<String, String> {
    let (_keep, path) = folder(&expanded(files));
    let found = Source { needed, by, ..Source::folder("camera-check", &path) }.whole_pictures();
    found.map(|found| found.taken).map_err(|e| crate::diagnostic::report(&e).replace(path.as_str(), "IMAGES"))
}

/// Files, the pairs that are needed, and what is said of what is taken.
const TAKEN: [(&str, usize, &str); 10] = [
    // A few stray pairs beside enough.
    (
        "set/{left,right}Img{1..7}.png demo/img{L,R}{1,2}.png",
        4,
        "7 pairs by name: left set/leftImg*.png, right set/rightImg*.png; not taken: demo/ (4 pictures)",
    ),
    (
        "{left,right}_{1,image}.png stereo{L,R}/{1..6}.png",
        4,
        "6 pairs by name: left stereoL/*.png, right stereoR/*.png; not taken: ./ (4 pictures)",
    ),
    (
        "demo/{left,right}.png {caml,camr}/{1..4}.png",
        4,
        "4 pairs by name: left caml/*.png, right camr/*.png; not taken: demo/ (2 pictures)",
    ),
    (
        "a/{left,right}{1..3}.png b/{left,right}1.png",
        3,
        "3 pairs by name: left a/left*.png, right a/right*.png; not taken: b/ (2 pictures)",
    ),
    (
        "cam{0,1}/{1..5}.png cam2/{1..3}.png",
        4,
        "5 pairs by name: left cam0/*.png, right cam1/*.png; no word tells left from right: the first by name is left; \
             not taken: cam2/ (3 pictures)",
    ),
    // A folder is read from above as it is read by itself, where that has enough.
    (
        "game/{left,right,board}.png game/{Left,Right}/{1..5}.png",
        1,
        "5 pairs by name: left game/Left/*.png, right game/Right/*.png; not taken: game/ (3 pictures)",
    ),
    (
        "game/{left,right}{1..5}.png game/{left,right}/1.png",
        4,
        "5 pairs by name: left game/left*.png, right game/right*.png; not taken: game/left/ (1 picture), game/right/ (1 picture)",
    ),
    // Results beside the pictures that they were made of.
    (
        "data/{corners,images,rectified}/{left,right}/Im_{1..5}.png",
        4,
        "5 pairs by name: left data/images/left/Im_*.png, right data/images/right/Im_*.png; \
             not taken: data/corners/left/ (5 pictures), data/corners/right/ (5 pictures), data/rectified/left/ (5 pictures), \
             data/rectified/right/ (5 pictures)",
    ),
    (
        "{left,right}Raw/{1..5}.png {left,right}Rectified/{1..5}.png",
        1,
        "5 pairs by name: left leftRaw/*.png, right rightRaw/*.png; \
             not taken: leftRectified/ (5 pictures), rightRectified/ (5 pictures)",
    ),
    // Results alone are what there is.
    ("rectified/{left,right}{1..5}.png", 4, "5 pairs by name: left rectified/left*.png, right rectified/right*.png"),
];

#[test]
fn what_gives_way_is_said_as_not_taken() {
    for (files, needed, taken) in TAKEN {
        assert_eq!(said(files, needed, None).as_deref(), Ok(taken), "{files}");
    }
}

#[test]
fn sets_of_equal_right_are_refused() {
    // Words of the refusal, two blanks apart.
    for (files, needed, words) in [
        // Enough in both, however unlike they are.
        (
            "a/{left,right}{1..7}.png b/{left,right}{1..30}.png",
            4,
            "in 2 ways  7 pairs  30 pairs  camera-check IMAGES/a`, or `stereocal camera-check IMAGES/b`",
        ),
        // Too few in both.
        ("a/{left,right}{1..3}.png b/{left,right}1.png", 4, "in 2 ways  IMAGES/a`  IMAGES/b`"),
        // Enough in both, where fewer are needed, or any number is of use.
        ("a/{left,right}{1..3}.png b/{left,right}{1..9}.png", 3, "in 2 ways"),
        ("set/{left,right}Img{1..7}.png demo/img{L,R}{1,2}.png", 1, "in 2 ways"),
        // Few whose names tell the sides beside enough whose names do not.
        (
            "demo/{left,right}{1,2}.png cam{1,2}/{1..6}.png",
            4,
            "in 2 ways  IMAGES/demo`  camera-check IMAGES/cam1 IMAGES/cam2`",
        ),
        // The same pictures read in another way are no stray ones.
        ("{a,b}_x_{1..3}.png {a,b}_y_{1,2}.png", 5, "in 2 ways  5 pairs  4 pairs  into a folder of its own"),
        // Called results, but not of these pictures; results of each other; within results.
        ("output/{left,right}{1..5}.png test/{left,right}{3..9}.png", 4, "in 2 ways  IMAGES/output`  IMAGES/test`"),
        ("{corners,rectified}/{left,right}{1..5}.png", 4, "in 2 ways"),
        ("results/{a,b}/{left,right}{1..5}.png", 4, "in 2 ways  IMAGES/results/a`"),
        ("{cornerstone,images}/{left,right}{1..5}.png", 4, "in 2 ways"),
    ] {
        let refusal = said(files, needed, None).expect_err(files);
        assert!(words.split("  ").all(|word| refusal.contains(word)), "{files}: {refusal}");
    }
}

#[test]
fn the_call_in_a_hint_reads_what_its_line_says() {
    // By itself this folder is its left/ and right/.
    let refusal = said("game/{left,right}{1..5}.png game/{left,right}/1.png", 1, None).unwrap_err();
    let calls =
        "camera-check IMAGES/game/left IMAGES/game/right`, or move each camera's pictures into a folder of its own";
    assert!(refusal.contains("5 pairs") && refusal.contains(calls), "{refusal}");
    assert!(!refusal.contains("IMAGES/game`"), "{refusal}");
    let ordered = said("{a,b}/{left,right}{1,2}.png", 1, Some(PairBy::Order)).unwrap_err();
    assert!(ordered.contains("camera-check IMAGES/a --pair-by order`"), "{ordered}");
}

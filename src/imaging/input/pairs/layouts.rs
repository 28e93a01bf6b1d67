//! Folders of stereo pictures as people publish them, one of each form: the names alone, with empty files.
//!
//! Patterns are those of [`expanded`]. Cut short where a form goes on in the same way.

use super::tests::{expanded, folder, outcome};
use super::{PairBy, Pairing};

/// Three lines each: repository and folder; the files; what comes of it, as [`told`] says it or, of a refusal, words of
/// it, two blanks apart. The last folder is refused with a hint that names `--pair-by order`, which makes pairs of it.
const LAYOUTS: &str = "\
# Two folders called left and right.
thiyagu1/Handy_Calib_Images: .
    {Left,Right}/{1..36}.jpg README.md
    36 pairs from 1 to 36: left Left/*.jpg
Roshnee/StereoCalibration: .
    left/left0{1..9}.jpg right/right0{1..9}.jpg disparity.jpg
    9 pairs from 01 to 09: left left/left*.jpg
shubhamwagh/stereo-calib: dataset
    {left/left,right/right}_p{0_0,0_1,0_2,1_3,10_30,10_31}.png board.pdf target_info.txt
    6 pairs from p0_0 to p10_31: left left/left_p*.png
SharkPeppero/stereo_calibration: data
    {left,right}/{0..23}.png 20250510_180342/{left/left,right/right}_{0..23}.png
    24 pairs from 0 to 23: left left/*.png
mengxz0203/RCS_3D: images
    left/left{01,05,06,08,09,12,15}.jpg right/right{02,07,09,11,12,15}.jpg test/{left/left,right/right}{1..15}.jpg
    3 pairs from 09 to 15: left left/left*.jpg
# The same one level deeper.
janicema0702/polyu-research: .
    calib/{left,right}/{1..8}.jpg
    8 pairs from 1 to 8: left calib/left/*.jpg
# Other names with a word or letter for the side.
minhDuc107886/stereo_Calibration: stereo*
    stereoLeft/imageL{0..6}.png stereoRight/imageR{0..6}.png
    7 pairs from image0 to image6: left stereoLeft/imageL*.png
andrea-abascal/stereo_vision_AIX: images
    original/image{0..30}.png stereoLeft/imageL{0,2,3,9,12,14,18}.png stereoRight/imageR{0,1,2,3,7,12,14,18}.png
    6 pairs from image0 to image18: left stereoLeft/imageL*.png
gxanesh/stereo_camera_calibration_v1: data/images
    stereoL/img{1..30}.png stereoR/img{1..30}.png delete_stereo_images.py
    30 pairs from img1 to img30: left stereoL/img*.png
Carzuiliam/calibrated-stereo-vision-system: calibration
    {l,r}Data/{1..30}.jpg
    30 pairs from 1 to 30: left lData/*.jpg
vccheng2001/Stereo-Camera-Calib-OpenCV: .
    capture_{left,right}/{0,10,20,90,100,110}.jpg
    6 pairs from 0 to 110: left capture_left/*.jpg
KehanBack/StereoCalibDemo: data/test_data
    20190903_01/{L,R}/{1..26}.png 20190903_01/{L,R}/imagePath.txt
    26 pairs from 1 to 26: left 20190903_01/L/*.png
HONGZHANG-WANG/Stereo_Calibration_and_estimated_distance: input/underwear_trepang
    trepang_left/trepang␣left_{1..8}.jpg trepang_right/trepang␣right_{1..8}.jpg
    8 pairs from trepang 1 to trepang 8: left trepang_left/trepang left_*.jpg
# No word for the side.
vic-w/stereo_calibration_and_triangulation: .
    cam1/b{00,01,02,09,10,14}.jpg cam2/a{00,01,02,09,10,14}.jpg matlab/calib.m
    6 pairs from 00 to 14: left cam1/b*.jpg
Xaizzz/StereoCalibration: calibr
    {cam1,cam2}/0204_1a/{0..13}.png m{1..10}.png loading.png images␣(2).jpg calibration_result.json
    14 pairs from 0 to 13: left cam1/0204_1a/*.png
# One folder, names that say the side.
sourishg/stereo-calibration: calib_imgs/1
    left{1..20}.jpg right{1..19}.jpg
    19 pairs from 1 to 19: left left*.jpg
aryanvij02/StereoVision: .
    images/image_{01..32}.png pairs/{left,right}_{01..11}.png pairs/{left,right}_{13,15}.png
    13 pairs from 01 to 15: left pairs/left_*.png
rubenmeester/stereobm320: .
    {0..54}_{left,right}.png
    55 pairs from 0 to 54: left *_left.png
shanheshejitu/Object-pose-estimation-based-on-two-cameras: .
    {1,2}{L,R}.jpg
    2 pairs from 1 to 2: left *L.jpg
ybaik/stereo_calibration: bin
    {l,r}1.jpg {l,r}1.txt
    1 pairs from 1 to 1: left l1.jpg
BakaAayush/Stereo-calibration: Depth sensing/calibration_images
    {left,right}_{001772455357526,001772456606777,001772457243382}.png left_001772846839725␣-␣Copy.png
    3 pairs from 001772455357526 to 001772457243382: left left_*.png
jerry8137/stereo_calibration_check: data/images
    chess_{left,right}_{distorted,rect}.png {rect,sync}_{left,right}.png thermal_{left,right}_{recalibrated,rectified}.png
    6 pairs from chess_distorted to thermal_rectified: left *.png
omoterikuto/stereo-vision-calibration: input
    FAST_{left,right}.jpg left1_gray.png right1_gray.png
    2 pairs from 1_gray to FAST: left *
omoterikuto/stereo-vision-calibration: calibration-result
    {000000_10_gray,GPU_corrected_image,calibrated_image,corrected_image}_{L,R}.png d{y,z}_corrected.png r{x,y,z}_corrected.png
    4 pairs from 000000_10_gray to corrected_image: left *_L.png
xmba15/stereo_calibration: data
    sample_{left,right}.png stereo_param_config.json
    1 pairs from sample to sample: left sample_left.png
# One folder, two cameras by number.
TemugeB/python_stereo_camera_calibrate: frames_pair
    camera{0,1}_{0..3}.png
    4 pairs from camera_0 to camera_3: left camera0_*.png
sebastiengilbert73/tutorial_calibrate_stereo_vision: calibration_images
    camera_{1,2}_{60,70,80,90,100,110,120}cm.png calibration_pattern_xy.csv
    7 pairs from camera_60cm to camera_120cm: left camera_1_*cm.png
# More than one reading.
minhDuc107886/stereo_Calibration: .
    stereoLeft/imageL{0..6}.png stereoRight/imageR{0..6}.png img_detect/img{L,R}{0,1}.png
    2 ways  camera-check IMAGES/img_detect`  camera-check IMAGES/stereoLeft IMAGES/stereoRight`
sourishg/stereo-calibration: calib_imgs
    {1,2}/left{1..20}.jpg {1,2}/right{1..19}.jpg
    2 ways  camera-check IMAGES/1`  camera-check IMAGES/2`
TemugeB/python_stereo_camera_calibrate: .
    frames/camera{0,1}_{0..3}.png frames_pair/camera{0,1}_{0..3}.png
    2 ways  camera-check IMAGES/frames_pair`
HONGZHANG-WANG/Stereo_Calibration_and_estimated_distance: input
    calib/{left,right}/{1..19}.jpg underwear_trepang/trepang_{left/trepang␣left,right/trepang␣right}_{1..8}.jpg
    2 ways  camera-check IMAGES/calib/left IMAGES/calib/right`
# Nothing that says which pictures belong together.
SIDDHARTH-S-001/Stereo_Vision_Tutorial: .
    images_left/image_{83342982396100,83343911497400,83350469575000}.png images_right/image_{83218230747000,83224084311800}.png
    5 pictures have no partner  images_left/: 3 pictures  3 left pictures and 2 right ones
tjresearch/research-aneesh_sai: calib_images
    left_{0,5,8,9,10,16}.png right_{2,3,7,20,27}.png
    11 pictures have no partner  ./: 11 pictures
sebastiengilbert73/tutorial_calibrate_stereo_vision: red_square_images, one folder a camera
    camera_1/2023-01-02_{165050.931152,165050.993401,165051.063160}.png camera_2/2023-01-02_{165050.940113,165051.001270,165051.070007}.png
    3 pairs from 2023-01-02_165050.931152 to 2023-01-02_165051.063160: left camera_1/2023-01-02_*.png
# Nothing but the order.
(the same, by another clock)
    camera_1/2023-01-02_{165050.931152,165050.993401,165051.063160}.png camera_2/2023-01-02_{165050.965113,165051.031270,165051.096007}.png
    --pair-by order`";

/// So many pairs, the name of the first and of the last, and what is said of the left pictures.
fn told(found: &Pairing) -> String {
    let (first, last) = (&found.pairs[0].pair, &found.pairs[found.pairs.len() - 1].pair);
    let (_, sides) = found.taken.split_once(": left ").unwrap();
    let (left, _) = sides.split_once(", right ").unwrap();
    format!("{} pairs from {first} to {last}: left {left}", found.pairs.len())
}

#[test]
fn folders_as_people_have_them() {
    let lines: Vec<&str> = LAYOUTS.lines().filter(|line| !line.starts_with('#')).map(str::trim).collect();
    for layout in lines.chunks(3) {
        let [owner, files, expected] = *layout else { panic!("{layout:?}") };
        let (_keep, path) = folder(&expanded(files));
        match outcome(&path, None) {
            Ok(found) => assert_eq!(told(&found), expected, "{owner}"),
            Err(said) => assert!(expected.split("  ").all(|word| said.contains(word)), "{owner}: {said}"),
        }
        if expected.starts_with("--pair-by order") {
            assert_eq!(outcome(&path, Some(PairBy::Order)).unwrap().pairs.len(), 3, "{owner}");
        }
    }
}

/// Other forms whose names tell the sides, and how many pairs each holds.
const TOLD: [(&str, usize); 24] = [
    ("left_images/left_{0..3}.jpg right_images/right_{0..3}.jpg", 4),
    ("videoLeft_000{0..3}.jpg videoRight_000{0..3}.jpg", 4),
    ("DJI_STE_{left,right}_{1073..1076}.jpg", 4),
    ("left/l{1..4}.jpg right/r{1..4}.jpg", 4),
    ("left/Im_L_{1..4}.png right/Im_R_{1..4}.png", 4),
    ("LEFT/opencv_Left_frame_{0..3}.png RIGHT/opencv_Right_frame_{0..3}.png", 4),
    ("calib_left/left{1..4}.tif calib_right/right{1..4}.tif", 4),
    ("{left,right}_cam/{1..4}.png", 4),
    ("{left,right}camera/{1..4}.png", 4),
    ("cam{left,right}/{1..4}.png", 4),
    ("{左,右}/{1..4}.png", 4),
    ("{1..4}_{左,右}.png", 4),
    ("左相机/图{1..4}.png 右相机/图{1..4}.png", 4),
    ("{links,rechts}/{1..4}.png", 4),
    ("{gauche,droite}{1..4}.png", 4),
    ("img{l,r}{01..04}.png", 4),
    ("left/{1..4}.png right/{1..4}.jpg", 4),
    ("left/0{1..4}.png right/{1..4}.png", 4),
    ("left/calib/{1..4}.png right/calib/{1..4}.png", 4),
    ("cam1/left_{1..4}.png cam2/right_{1..4}.png", 4),
    ("right_angle_{left,right}_{1..4}.png", 4),
    ("stereo_{L,R}_2021-03-04_10{10,11,12}.png", 3),
    ("left/WIN_20210304_11_22_{10,11}_Pro.jpg right/WIN_20210304_11_22_{10,11}_Pro.jpg", 2),
    ("rgb/{1..4}_left.png rgb/{1..4}_right.png", 4),
];

/// Forms in which no word does: the first by name is left.
const UNTOLD: [(&str, usize); 11] = [
    ("image{0,1}/{0..3}.png", 4),
    ("image_{0,1}/00000{0..3}.png", 4),
    ("cam{0,1}/data/{1403715273262142976,1403715273312143104}.png", 2),
    ("{0,1}/{1..4}.png", 4),
    ("{A,B}/{1..4}.png", 4),
    ("{A,B}0{1..4}.png", 4),
    ("cam_{a,b}_{1..4}.png", 4),
    ("{master,slave}_{1..4}.png", 4),
    ("a/{1..4}.png b/{1..4}.png", 4),
    ("front_camera/{1..4}.png rear_camera/{1..4}.png", 4),
    ("right_bench/cam1/{1..4}.png right_bench/cam2/{1..4}.png", 4),
];

#[test]
fn other_forms() {
    for (k, (files, count)) in TOLD.into_iter().chain(UNTOLD).enumerate() {
        let (_keep, path) = folder(&expanded(files));
        let found = outcome(&path, None).unwrap_or_else(|e| panic!("{files}: {e}"));
        assert_eq!(found.pairs.len(), count, "{files}");
        let untold = "; no word tells left from right: the first by name is left";
        assert_eq!(found.taken.ends_with(untold), k >= TOLD.len(), "{files}: {}", found.taken);
        let first = &found.pairs[0];
        let [left, right] = [&first.left, &first.right].map(|p| p.strip_prefix(&path).unwrap().as_str().to_lowercase());
        let says = |name: &str, words: [&str; 5]| words.iter().any(|word| name.contains(word));
        let told = says(&left, ["left", "左", "links", "gauche", "l"])
            && says(&right, ["right", "右", "rechts", "droite", "r"]);
        assert!(if k < TOLD.len() { told } else { left < right }, "{files}: {}", found.taken);
    }
}

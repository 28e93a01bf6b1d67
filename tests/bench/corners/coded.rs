//! Boards with markers and grids of tags, seen in part: whether any corner has another's number, and how well and how surely the corners lie.
//!
//! Every dictionary, markers of 0.6 to 0.8 of a square, or every family of tags, gaps of 0.2 to 0.4 of a tag; tilts to 60 degrees, blur to 2.5 px, noise to 5 grey levels, squares of 12 to 70 px, from the
//! whole board down to a tenth of it. `-- coded FIRST COUNT` (of grids of tags `-- tags FIRST COUNT`) takes the pictures from one number on, so that parts of a long run add up; with a
//! folder behind that the pictures are written there with truth and findings, for `scripts/peers_coded.py`.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use nalgebra::{Point2, Vector3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use stereocal::geometry::transform;
use stereocal::imaging::board::Kind;
use stereocal::imaging::board::dictionary::Dictionary;
use stereocal::imaging::find::corners_in;
use stereocal::imaging::image::{Image, Picture};
use stereocal::imaging::{Board, Corner};
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::true_rig;

/// Side of the pictures, px.
const SIZE: u32 = 1000;
/// Which boards are looked at.
#[derive(Clone, Copy)]
pub enum Coded {
    /// ChArUco.
    Markers,
    /// Kalibr's grids of AprilTags.
    Tags,
}

/// A corner farther from its truth than this share of the least step of the board has another's number.
const WRONG: f64 = 0.4;

/// What a picture shows, and how.
struct Case {
    board: Board,
    turn: Vector3<f64>,
    at: Vector3<f64>,
    blur_px: f64,
    noise: f64,
}

/// A corner that was found: how far off, in px and in its own sigmas.
struct Found {
    off_px: f64,
    chi2: f64,
    /// Whether the margin round the markers is at least three blurs and two px as it is seen.
    has_margin: bool,
    is_wrong: bool,
}

/// One picture's outcome.
struct Outcome {
    name: String,
    board: String,
    /// Corners in view.
    visible: usize,
    corners: Vec<Found>,
    reason: Option<String>,
}

/// A number in [0, 1) a call.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Pcg64::seed_from_u64(seed);
    move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

impl Case {
    /// The picture of this number.
    fn drawn(kind: Coded, number: usize) -> Case {
        let mut uniform = uniform(1000 + number as u64);
        let name = match kind {
            Coded::Markers => {
                let dictionaries: Vec<Dictionary> = Dictionary::all().collect();
                let dictionary = dictionaries[number % dictionaries.len()];
                let (columns, rows) = if dictionary.count() >= 40 { (10, 7) } else { (7, 5) };
                let share = [0.6, 0.7, 0.8][number / dictionaries.len() % 3];
                format!("charuco:{columns}x{rows}:20:{}:{}:new", 20.0 * share, dictionary.name())
            }
            Coded::Tags => {
                let families: Vec<Dictionary> = Dictionary::all().filter(|d| d.name().contains("APRILTAG")).collect();
                let family = families[number % families.len()];
                let gap = [0.2, 0.3, 0.4][number / families.len() % 3];
                format!("apriltag:6x4:{}:40:{}", family.tag_name(), 40.0 * gap)
            }
        };
        let (tilt, about, roll) = (uniform() * 60f64.to_radians(), uniform() * TAU, uniform() * TAU);
        let turn = nalgebra::Rotation3::new(Vector3::new(about.cos(), about.sin(), 0.0) * tilt)
            * nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, roll));
        // From a far board that is wholly in the picture to a near one of which a corner is.
        let square_px = 12.0 * (70.0f64 / 12.0).powf(uniform());
        let focal_px = true_rig(SIZE).left.fx;
        let z = focal_px * 20.0 / square_px;
        let half = f64::from(SIZE) / 2.0 * z / focal_px;
        let at = Vector3::new(half * (2.0 * uniform() - 1.0), half * (2.0 * uniform() - 1.0), z);
        Case {
            board: name.parse().unwrap(),
            turn: turn.scaled_axis(),
            at,
            blur_px: 0.5 + 2.0 * uniform(),
            noise: 0.5 + 4.5 * uniform(),
        }
    }

    /// The picture, and where the board's corners really are.
    fn taken(&self, number: usize) -> (Image<u8>, Vec<Point2<f64>>) {
        let workmanship =
            Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 10.0 };
        let made = PhysicalBoard::new(self.board, workmanship, 1, 0);
        let backdrop = Backdrop::plain(0.3);
        let full_well_e = 10_000.0;
        let scene = Scene {
            camera: true_rig(SIZE).left,
            optics: Optics { gaussian_px: self.blur_px, defocus: None, coma_px: 0.0 },
            board: &made,
            camera_from_board: transform(self.turn, self.at),
            print: Print { white: 0.85, black: 0.08, rim: 0.3, rim_mm: 3.0 },
            holder: &[],
            backdrop: &backdrop,
            lighting: Lighting { gradient: (0.1, -0.05), vignetting: 0.1, exposure: 0.75 },
            sensor: Sensor { bits: 8, full_well_e, read_noise_e: self.noise / 255.0 * full_well_e, dark: 0.02 },
            seed: 5,
            picture: number as u64,
        };
        let truth = scene.corners_px();
        let rendered = Renderer::new(&scene).picture(&NormalTable::new());
        let pixels = rendered.samples.iter().map(|&v| v as u8).collect();
        (Image { width: rendered.width, height: rendered.height, pixels }, truth)
    }
}

/// The least distance of a corner from its neighbours on the board.
fn step_px(board: &Board, truth: &[Point2<f64>], (col, row): (usize, usize)) -> f64 {
    let at = |c: usize, r: usize| (c < board.columns() && r < board.rows()).then(|| truth[board.index(c, r)]);
    let here = truth[board.index(col, row)];
    let around = [(col + 1, row), (col.wrapping_sub(1), row), (col, row + 1), (col, row.wrapping_sub(1))];
    around.into_iter().filter_map(|(c, r)| at(c, r)).map(|p| (p - here).norm()).fold(f64::INFINITY, f64::min)
}

fn judge(case: &Case, corner: &Corner, truth: &[Point2<f64>]) -> Found {
    // How far what is printed in a square stays from its edges, as a share of the least step.
    let margin = match case.board.kind {
        Kind::Checker => panic!("a board with markers"),
        Kind::Charuco { marker_mm, .. } => (1.0 - marker_mm / case.board.square_mm) / 2.0,
        Kind::Tags { gap_mm, family } => (2.0 / (family.bits() + 4) as f64 * case.board.square_mm / gap_mm).min(1.0),
    };
    let off = corner.px - truth[case.board.index(corner.col, corner.row)];
    let step = step_px(&case.board, truth, (corner.col, corner.row));
    let margin_px = margin * step;
    let chi2 = corner.covariance_px2.and_then(|s| Some(off.dot(&(s.try_inverse()? * off)) / 2.0));
    Found {
        off_px: off.norm(),
        chi2: chi2.unwrap_or(f64::NAN),
        has_margin: margin_px >= (3.0 * case.blur_px).max(2.0),
        is_wrong: off.norm() > WRONG * step,
    }
}

fn look(kind: Coded, number: usize, folder: Option<&Path>) -> Outcome {
    let case = Case::drawn(kind, number);
    let (image, truth) = case.taken(number);
    let inside = |p: &&Point2<f64>| p.iter().all(|v| (0.0..f64::from(SIZE) - 1.0).contains(v));
    let visible = truth.iter().filter(inside).count();
    let name = format!("{number:06}");
    let found = corners_in(&Picture::from(image.clone()), case.board);
    if let Some(folder) = folder {
        write(folder, &name, &case, &image, &truth, found.as_ref().ok());
    }
    let board = case.board.to_string();
    match found {
        Err(refusal) => Outcome { name, board, visible, corners: Vec::new(), reason: Some(refusal.reason) },
        Ok(corners) => {
            let measured = corners.cells.iter().flatten().filter(|corner| corner.used);
            let corners = measured.map(|corner| judge(&case, corner, &truth)).collect();
            Outcome { name, board, visible, corners, reason: None }
        }
    }
}

/// The picture, and a table of id, true place, place found (empty where it was not), whether it has a margin, and its squared deviation in sigmas.
fn write(
    folder: &Path,
    name: &str,
    case: &Case,
    image: &Image<u8>,
    truth: &[Point2<f64>],
    found: Option<&stereocal::imaging::lattice::Lattice<Corner>>,
) {
    let mut pgm = format!("P5\n{} {}\n255\n", image.width, image.height).into_bytes();
    pgm.extend_from_slice(&image.pixels);
    std::fs::write(folder.join(format!("{name}.pgm")), pgm).expect("a picture is written");
    let mut table = format!("{}\n", case.board);
    for id in 0..truth.len() {
        let (col, row) = case.board.by_id(id);
        let at = truth[case.board.index(col, row)];
        let corner = found.and_then(|grid| grid.get(col, row)).filter(|corner| corner.used);
        let place = corner.map_or(",".to_owned(), |corner| format!("{},{}", corner.px.x, corner.px.y));
        let judged = corner.map(|corner| judge(case, corner, truth));
        let margin = judged.as_ref().is_some_and(|judged| judged.has_margin);
        let chi2 = judged.map_or(String::new(), |judged| judged.chi2.to_string());
        writeln!(table, "{id},{},{},{place},{},{chi2}", at.x, at.y, u8::from(margin)).expect("a line");
    }
    std::fs::write(folder.join(format!("{name}.csv")), table).expect("a table is written");
}

/// Looks at so many pictures from one number on, and prints what came of it.
pub fn table(kind: Coded, first: usize, count: usize, folder: Option<&Path>) {
    let outcomes: Vec<Outcome> =
        (first..first + count).into_par_iter().map(|number| look(kind, number, folder)).collect();
    let (boards, field) = match kind {
        Coded::Markers => ("ChArUco boards", 4),
        Coded::Tags => ("grids of AprilTags", 2),
    };
    println!("{boards} in part, {SIZE} px, pictures {first} to {}: corners by the markers' codes", first + count);
    println!(
        "markers     pictures  found   corners  wrong | margin of 3 blurs and 2 px: corners  chi2  rms px | less: corners  chi2  rms px"
    );
    let group = |outcome: &&Outcome| outcome.board.split(':').nth(field).unwrap_or_default().replace("DICT_", "");
    let family = |name: String| name.split('_').take(2).collect::<Vec<_>>().join("_");
    let mut families: Vec<String> = outcomes.iter().map(|o| family(group(&o))).collect();
    families.sort();
    families.dedup();
    for name in families {
        let of: Vec<&Outcome> = outcomes.iter().filter(|o| family(group(o)) == name).collect();
        line(&name, &of);
    }
    line("all", &outcomes.iter().collect::<Vec<_>>());
    for outcome in outcomes.iter().filter(|o| o.corners.iter().any(|c| c.is_wrong)).take(20) {
        let wrong = outcome.corners.iter().filter(|c| c.is_wrong).count();
        println!(
            "   picture {}: {} has {wrong} wrong numbers of {}",
            outcome.name,
            outcome.board,
            outcome.corners.len()
        );
    }
    let missed = outcomes.iter().filter(|o| o.reason.is_some() && o.visible >= 12);
    for outcome in missed.take(12) {
        let reason = outcome.reason.as_deref().unwrap_or_default();
        println!("   picture {}: {} with {} corners in view: {reason}", outcome.name, outcome.board, outcome.visible);
    }
}

fn line(name: &str, outcomes: &[&Outcome]) {
    let corners: Vec<&Found> = outcomes.iter().flat_map(|o| &o.corners).collect();
    let found = outcomes.iter().filter(|o| o.reason.is_none()).count();
    let wrong = corners.iter().filter(|c| c.is_wrong).count();
    let figures = |has_margin: bool| {
        let of: Vec<&&Found> = corners.iter().filter(|c| c.has_margin == has_margin && !c.is_wrong).collect();
        let mean = |value: &dyn Fn(&Found) -> f64| of.iter().map(|c| value(c)).sum::<f64>() / of.len() as f64;
        let (chi2, square) = (mean(&|c| c.chi2), mean(&|c| c.off_px * c.off_px / 2.0));
        format!("{:7} {chi2:6.3} {:7.4}", of.len(), square.sqrt())
    };
    let (yes, no) = (figures(true), figures(false));
    println!("{name:14} {:5} {found:6} {:9} {wrong:6} | {yes} | {no}", outcomes.len(), corners.len());
}

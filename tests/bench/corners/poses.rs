//! Boards at all tilts and turns: how many are found, and whether any is read in a wrong order or at wrong places.

use std::f64::consts::TAU;

use nalgebra::{Point2, Vector3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use stereocal::geometry::{Transform, transform};
use stereocal::imaging::image::{Image, Picture};
use stereocal::imaging::lattice::{Lattice, Places};
use stereocal::imaging::{Board, detect, order, refine};
use stereocal::simulate::clutter;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::true_rig;
use stereocal::stereo::Rig;

/// Side of the pictures, px.
const SIZE: u32 = 1280;
/// A corner farther than this from its truth is another thing, px.
const WRONG_PX: f64 = 0.5;

/// What became of one board.
#[derive(Default)]
struct Count {
    pairs: usize,
    found: usize,
    /// Corners of the boards found that could not be measured.
    unmeasured: usize,
    wrong_order: usize,
    wrong_place: usize,
    refusals: Vec<String>,
}

/// Draws `pairs` pairs of each board, looks for it, and prints what came of it.
pub fn table(pairs: usize) {
    println!("boards at tilts to 60 degrees and all turns, blur 0.6 to 2.5 px, uneven light, clutter; {SIZE} px");
    println!("board   pairs  found in both  wrong order  wrong place  corners not measured");
    for (squares, square_mm) in [("20x20", 10.0), ("10x7", 18.0), ("7x7", 20.0)] {
        let drawing = Board::checker(squares.parse().expect("a board"), square_mm);
        let count = run(drawing, pairs.div_ceil(3));
        let share = 100.0 * count.found as f64 / count.pairs as f64;
        let (order, place) = (count.wrong_order, count.wrong_place);
        println!(
            "{squares:6} {:6} {share:12.1} % {order:12} {place:12} {:13} of {}",
            count.pairs,
            count.unmeasured,
            2 * count.found * drawing.corner_count()
        );
        count.refusals.iter().take(12).for_each(|line| println!("   {line}"));
    }
}

fn run(drawing: Board, pairs: usize) -> Count {
    let workmanship =
        Workmanship { pitch_um: 1.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 10.0 };
    let board = PhysicalBoard::new(drawing, workmanship, 1, 0);
    let rig = true_rig(SIZE);
    let mut random = Pcg64::seed_from_u64(7);
    let mut uniform = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut count = Count { pairs, ..Count::default() };
    let (mut seen, mut truths) = (Vec::new(), Vec::new());
    for pair in 0..pairs {
        let pose = pose_in_view(&rig, &board, &mut uniform);
        let blur = 0.6 + 1.9 * uniform();
        let light = Lighting {
            gradient: (0.6 * uniform() - 0.3, 0.6 * uniform() - 0.3),
            vignetting: 0.2 * uniform(),
            exposure: 0.3 + 0.4 * uniform(),
        };
        let mut sides = [None, None];
        let mut truth = [Vec::new(), Vec::new()];
        for side in 0..2 {
            let camera_from_left = if side == 0 { Transform::identity() } else { rig.right_from_left };
            let camera = if side == 0 { rig.left } else { rig.right };
            let backdrop = Backdrop::new(&camera, &camera_from_left, &clutter::behind(3, pair as u64), 3, pair as u64);
            let scene = Scene {
                camera,
                optics: Optics { gaussian_px: blur, defocus: None, coma_px: 0.0 },
                board: &board,
                camera_from_board: camera_from_left * pose,
                print: Print { white: 0.85, black: 0.08, rim: 0.3, rim_mm: 3.0 },
                holder: &[],
                backdrop: &backdrop,
                lighting: light,
                sensor: Sensor { bits: 8, full_well_e: 10_000.0, read_noise_e: 10.0, dark: 0.02 },
                seed: 1,
                picture: (2 * pair + side) as u64,
            };
            truth[side] = scene.corners_px();
            match look(&scene, drawing) {
                Ok(places) => sides[side] = Some(places),
                Err(reason) => count.refusals.push(format!("pair {pair}, side {side}, blur {blur:.2} px: {reason}")),
            }
        }
        if let [Some(left), Some(right)] = sides {
            seen.push((left, right));
            truths.push((pair, truth));
        }
    }
    count.found = seen.len();
    let lacks = |grid: &Places| drawing.corner_count() - grid.count();
    count.unmeasured = seen.iter().map(|(left, right)| lacks(left) + lacks(right)).sum();
    judge(&seen, &truths, drawing, &mut count);
    count
}

fn look(scene: &Scene, drawing: Board) -> Result<Places, String> {
    let rendered = Renderer::new(scene).picture(&NormalTable::new());
    let pixels: Vec<u8> = rendered.samples.iter().map(|&v| v as u8).collect();
    let picture = Picture::from(Image { width: rendered.width, height: rendered.height, pixels });
    let detected = detect::detect(&picture, drawing).map_err(|refusal| refusal.reason)?;
    // What could not be measured is kept at its rough place, marked as not used.
    let corners = refine::refine(&picture, &detected);
    Ok(Lattice::from_fn(corners.columns, corners.rows, |col, row| {
        corners.get(col, row).filter(|corner| corner.used).map(|corner| corner.px)
    }))
}

/// A pose in which both cameras see the whole plate.
fn pose_in_view(rig: &Rig, board: &PhysicalBoard, uniform: &mut impl FnMut() -> f64) -> Transform {
    let (w, h) = board.plate_half_mm();
    loop {
        let (tilt, about, turn) = (60f64.to_radians() * uniform(), TAU * uniform(), TAU * uniform());
        let rotation = nalgebra::Rotation3::new(Vector3::new(about.cos(), about.sin(), 0.0) * tilt)
            * nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, turn));
        let distance = 500.0 + 500.0 * uniform();
        let reach = 0.1 * distance;
        let at = Vector3::new(reach * (2.0 * uniform() - 1.0), reach * (2.0 * uniform() - 1.0), distance);
        let pose = transform(rotation.scaled_axis(), at);
        let in_view = [(-w, -h), (w, -h), (w, h), (-w, h)].into_iter().all(|(x, y)| {
            let p = pose * board.on_surface(x, y);
            let inside = |px: Point2<f64>| px.iter().all(|v| (4.0..f64::from(SIZE) - 4.0).contains(v));
            inside(rig.left.project(&p)) && inside(rig.right.project(&(rig.right_from_left * p)))
        });
        if in_view {
            return pose;
        }
    }
}

/// Counts pairs whose sides are numbered differently, and those with a corner that is none.
fn judge(seen: &[(Places, Places)], truths: &[(usize, [Vec<Point2<f64>>; 2])], drawing: Board, count: &mut Count) {
    for (((left, right), (pair, truth)), turns) in seen.iter().zip(truths).zip(order::agreed_turns(seen, drawing)) {
        let sides = [left.turned(turns.0), right.turned(turns.1)];
        // The simulated board's numbering is one of those that the colours allow.
        let fits: Vec<Vec<f64>> = (0..4)
            .map(|quarters| sides.iter().zip(truth).map(|(grid, truth)| worst(&grid.turned(quarters), truth)).collect())
            .collect();
        if fits.iter().any(|sides| sides.iter().all(|&w| w < WRONG_PX)) {
            continue;
        }
        let alone = |side: usize| fits.iter().any(|sides| sides[side] < WRONG_PX);
        if alone(0) && alone(1) {
            count.wrong_order += 1;
            count.refusals.push(format!("pair {pair}: the sides are numbered differently"));
        } else {
            count.wrong_place += 1;
            let least = |side: usize| fits.iter().map(|sides| sides[side]).fold(f64::MAX, f64::min);
            count.refusals.push(format!("pair {pair}: worst corners off by {:.2} and {:.2} px", least(0), least(1)));
        }
    }
}

fn worst(grid: &Places, truth: &[Point2<f64>]) -> f64 {
    if grid.columns * grid.rows != truth.len() {
        return f64::MAX;
    }
    let truth = Lattice { columns: grid.columns, rows: grid.rows, cells: truth.iter().map(|p| Some(*p)).collect() };
    let distance = |col, row, p: &Point2<f64>| truth.get(col, row).map_or(f64::MAX, |t: &Point2<f64>| (t - p).norm());
    grid.iter().map(|(col, row, p)| distance(col, row, p)).fold(0.0, f64::max)
}

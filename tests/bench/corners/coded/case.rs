//! Which pictures are taken: the board, where it lies, how sharp and how noisy it is.

use std::f64::consts::TAU;

use nalgebra::{Point2, Vector3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use stereocal::geometry::{Transform, transform};
use stereocal::imaging::Board;
use stereocal::imaging::board::dictionary::Dictionary;
use stereocal::imaging::image::Image;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::true_rig;
use stereocal::stereo::Camera;

/// Side of the pictures, px.
pub const SIZE: u32 = 1000;
/// Which boards are looked at.
#[derive(Clone, Copy)]
pub enum Coded {
    /// ChArUco.
    Markers,
    /// Kalibr's grids of AprilTags.
    Tags,
    /// OpenCV's.
    Grid,
}

pub const PRINT: Print = Print { white: 0.85, black: 0.08, rim: 0.3, rim_mm: 3.0 };
pub const LIGHTING: Lighting = Lighting { gradient: (0.1, -0.05), vignetting: 0.1, exposure: 0.75 };
/// Side of a square, and of a tag, mm.
const SQUARE_MM: f64 = 20.0;
const TAG_MM: f64 = 40.0;

/// What a picture shows, and how.
pub struct Case {
    pub board: Board,
    pub tilt_deg: f64,
    pub camera: Camera,
    pub camera_from_board: Transform,
    pub blur_px: f64,
    pub noise: f64,
}

/// A number in [0, 1) a call.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Pcg64::seed_from_u64(seed);
    move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// The board of this number.
fn board(kind: Coded, number: usize) -> Board {
    let name = match kind {
        Coded::Markers => {
            let dictionaries: Vec<Dictionary> = Dictionary::all().collect();
            let dictionary = dictionaries[number % dictionaries.len()];
            let (columns, rows) = if dictionary.count() >= 40 { (10, 7) } else { (7, 5) };
            let share = [0.6, 0.7, 0.8][number / dictionaries.len() % 3];
            format!("charuco:{columns}x{rows}:{SQUARE_MM}:{}:{}:new", SQUARE_MM * share, dictionary.name())
        }
        Coded::Tags | Coded::Grid => {
            let families: Vec<Dictionary> = Dictionary::all().filter(|d| d.name().contains("APRILTAG")).collect();
            let family = families[number % families.len()];
            let gap = [0.2, 0.3, 0.4][number / families.len() % 3];
            let layout = if matches!(kind, Coded::Grid) { ":opencv" } else { "" };
            format!("apriltag:6x4:{}:{TAG_MM}:{}{layout}", family.said(), TAG_MM * gap)
        }
    };
    name.parse().unwrap()
}

impl Case {
    /// The picture of this number: every other one shows a tenth to a half of the board.
    pub fn drawn(kind: Coded, number: usize) -> Case {
        /// Places that are tried for a part of the wanted size; a far board has none.
        const TRIES: usize = 300;
        let mut uniform = uniform(1000 + number as u64);
        let board = board(kind, number);
        let (tilt, about, roll) = (uniform() * 60f64.to_radians(), uniform() * TAU, uniform() * TAU);
        let turn = nalgebra::Rotation3::new(Vector3::new(about.cos(), about.sin(), 0.0) * tilt)
            * nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, roll));
        let (blur_px, noise) = (0.5 + 2.0 * uniform(), 0.5 + 4.5 * uniform());
        // From a far board that is wholly in the picture to a near one of which a corner is.
        let square_px = 12.0 * (100.0f64 / 12.0).powf(uniform());
        let camera = true_rig(SIZE).left;
        let z = camera.fx * SQUARE_MM / square_px;
        let half = f64::from(SIZE) / 2.0 * z / camera.fx;
        // So far from the middle that half of the board may be out of the picture on either side.
        let far = half + board.extent_mm()[0] / 2.0;
        let wanted = if number.is_multiple_of(2) { 0.5..=1.0 } else { 0.1..=0.5 };
        let mut case = Case {
            board,
            tilt_deg: tilt.to_degrees(),
            camera,
            camera_from_board: Transform::identity(),
            blur_px,
            noise,
        };
        for _ in 0..TRIES {
            let at = Vector3::new(far * (2.0 * uniform() - 1.0), far * (2.0 * uniform() - 1.0), z);
            case.camera_from_board = transform(turn.scaled_axis(), at);
            if wanted.contains(&case.share_seen()) {
                break;
            }
        }
        case
    }

    /// Where the board's corners are in the picture, px.
    pub fn truth(&self) -> Vec<Point2<f64>> {
        self.board.corners_mm().map(|p| self.camera.project(&(self.camera_from_board * p))).collect()
    }

    /// How many corners are in the picture.
    pub fn visible(&self) -> usize {
        let inside = |p: &&Point2<f64>| p.iter().all(|v| (0.0..f64::from(SIZE) - 1.0).contains(v));
        self.truth().iter().filter(inside).count()
    }

    /// The share of the board's corners that are in the picture.
    pub fn share_seen(&self) -> f64 {
        self.visible() as f64 / self.board.corner_count() as f64
    }

    /// Side of the squares in the board's middle as seen from before it, px.
    pub fn square_px(&self) -> f64 {
        self.camera.fx * SQUARE_MM / self.camera_from_board.translation.z
    }

    pub fn sensor(&self) -> Sensor {
        let full_well_e = 10_000.0;
        Sensor { bits: 8, full_well_e, read_noise_e: self.noise / 255.0 * full_well_e, dark: 0.02 }
    }

    /// The picture.
    pub fn taken(&self, number: usize) -> Image<u8> {
        let workmanship =
            Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 10.0 };
        let made = PhysicalBoard::new(self.board, workmanship, 1, 0);
        let backdrop = Backdrop::plain(0.3);
        let scene = Scene {
            camera: self.camera,
            optics: Optics { gaussian_px: self.blur_px, defocus: None, coma_px: 0.0 },
            board: &made,
            camera_from_board: self.camera_from_board,
            print: PRINT,
            holder: &[],
            backdrop: &backdrop,
            lighting: LIGHTING,
            sensor: self.sensor(),
            seed: 5,
            picture: number as u64,
        };
        let rendered = Renderer::new(&scene).picture(&NormalTable::new());
        let pixels = rendered.samples.iter().map(|&v| v as u8).collect();
        Image { width: rendered.width, height: rendered.height, pixels }
    }
}

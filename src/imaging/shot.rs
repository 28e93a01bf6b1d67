//! Boards rendered for tests: a picture, and where the board's corners really are in it.

use nalgebra::{Point2, Vector3};

use crate::geometry::transform;
use crate::imaging::Board;
use crate::imaging::image::{Grey, Image, Picture};
use crate::simulate::draws::NormalTable;
use crate::simulate::physical_board::{PhysicalBoard, Workmanship};
use crate::simulate::picture::backdrop::Backdrop;
use crate::simulate::picture::psf::Optics;
use crate::simulate::picture::render::Renderer;
use crate::simulate::picture::scene::{Print, Scene};
use crate::simulate::picture::sensor::{Lighting, Sensor};
use crate::simulate::rig::true_rig;

/// Side of the pictures, px.
const SIZE: u32 = 800;

/// What is in a picture of a board.
#[derive(Clone, Copy)]
pub struct Shot {
    pub board: &'static str,
    /// How it is turned, rad, and where it is, mm.
    pub pose: ([f64; 3], [f64; 3]),
    /// White on black.
    pub inverted: bool,
    /// How many times as strong the lens's distortion is as that of the paper's.
    pub bent: f64,
    pub seed: u64,
}

impl Shot {
    pub fn of(board: &'static str, turn: [f64; 3], place: [f64; 3]) -> Shot {
        Shot { board, pose: (turn, place), inverted: false, bent: 1.0, seed: 3 }
    }

    /// The picture, and where the board's corners really are.
    pub fn taken(self) -> (Picture, Vec<Point2<f64>>) {
        let board: Board = self.board.parse().unwrap();
        let workmanship =
            Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 10.0 };
        let made = PhysicalBoard::new(board, workmanship, 1, 0);
        let backdrop = Backdrop::plain(0.3);
        let (white, black) = if self.inverted { (0.08, 0.85) } else { (0.85, 0.08) };
        let mut camera = true_rig(SIZE).left;
        camera.distortion.iter_mut().for_each(|term| *term *= self.bent);
        let (turn, place) = self.pose;
        let scene = Scene {
            camera,
            optics: Optics { gaussian_px: 0.8, defocus: None, coma_px: 0.0 },
            board: &made,
            camera_from_board: transform(Vector3::from(turn), Vector3::from(place)),
            print: Print { white, black, rim: 0.3, rim_mm: 3.0 },
            holder: &[],
            backdrop: &backdrop,
            lighting: Lighting { gradient: (0.05, -0.03), vignetting: 0.1, exposure: 0.75 },
            sensor: Sensor { bits: 16, full_well_e: 10_000.0, read_noise_e: 5.0, dark: 0.0 },
            seed: self.seed,
            picture: 0,
        };
        let truth = scene.corners_px();
        let rendered = Renderer::new(&scene).picture(&NormalTable::new());
        let pixels = rendered.samples.iter().map(|&v| ((u32::from(v) + 128) / 257) as u8).collect();
        (Image { width: rendered.width, height: rendered.height, pixels }.into(), truth)
    }
}

/// The grey values of a picture.
pub fn eight_bits(picture: &Picture) -> &Image<u8> {
    let Picture { grey: Grey::Eight(image), .. } = picture else { panic!("eight bits") };
    image
}

/// The picture with some of its pixels changed.
pub fn with_pixels(picture: &Picture, change: impl Fn(&Image<u8>, usize, usize) -> u8) -> Picture {
    let image = eight_bits(picture);
    Image::from_fn(image.width, image.height, |x, y| change(image, x, y)).into()
}

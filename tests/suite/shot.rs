//! One picture of a board by the simulator, with the true places of its corners, and how far off the corners are that
//! imaging finds in it.

use nalgebra::{Point2, Vector3};
use stereocal::geometry::transform;
use stereocal::imaging::find::corners_in;
use stereocal::imaging::image::{Image, Picture};
use stereocal::imaging::lattice::Lattice;
use stereocal::imaging::{Board, Corner};
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::patch::Patch;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::true_rig;

/// What is photographed, and how.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Side of the picture, px.
    pub size: u32,
    /// The board's squares.
    pub squares: &'static str,
    /// Side of a square, mm.
    pub square_mm: f64,
    /// White round the squares, mm.
    pub margin_mm: f64,
    /// Standard deviation of the lens's blur, px.
    pub blur_px: f64,
    /// How the board is turned, rad, and where it is, mm.
    pub pose: ([f64; 3], [f64; 3]),
    /// Electrons of white, and of the noise of reading.
    pub electrons: (f64, f64),
    /// Light of the white squares as a share of the sensor's range.
    pub exposure: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// What lies on the board.
    pub covers: Vec<Patch>,
}

impl Default for Setup {
    fn default() -> Setup {
        Setup {
            size: 1280,
            squares: "20x20",
            square_mm: 10.0,
            margin_mm: 8.0,
            blur_px: 0.9,
            pose: ([0.25, -0.2, 0.12], [2.0, -3.0, 570.0]),
            electrons: (10_000.0, 5.0),
            exposure: 0.75,
            seed: 1,
            covers: Vec::new(),
        }
    }
}

/// A board in a picture of 16 bits, and where its corners are.
pub struct Shot {
    /// The board.
    pub board: Board,
    /// The picture.
    pub image: Image<u16>,
    /// True places of the corners, row by row, px.
    pub truth: Vec<Point2<f64>>,
}

impl Setup {
    /// Takes the picture.
    pub fn take(&self) -> Shot {
        let board = Board::checker(self.squares.parse().unwrap(), self.square_mm);
        let workmanship = Workmanship {
            pitch_um: 0.0,
            bow_um: (0.0, 0.0),
            ink_spread_um: 0.0,
            scale_ppm: 0.0,
            margin_mm: self.margin_mm,
        };
        let mut made = PhysicalBoard::new(board, workmanship, 1, 0);
        made.covers.clone_from(&self.covers);
        let backdrop = Backdrop::plain(0.3);
        let (turn, place) = self.pose;
        let scene = Scene {
            camera: true_rig(self.size).left,
            optics: Optics { gaussian_px: self.blur_px, defocus: None, coma_px: 0.0 },
            board: &made,
            camera_from_board: transform(Vector3::from(turn), Vector3::from(place)),
            print: Print { white: 0.85, black: 0.08, rim: 0.3, rim_mm: 3.0 },
            holder: &[],
            backdrop: &backdrop,
            lighting: Lighting { gradient: (0.08, -0.05), vignetting: 0.1, exposure: self.exposure },
            sensor: Sensor { bits: 16, full_well_e: self.electrons.0, read_noise_e: self.electrons.1, dark: 0.02 },
            seed: self.seed,
            picture: 0,
        };
        let truth = scene.corners_px();
        let rendered = Renderer::new(&scene).picture(&NormalTable::new());
        Shot { board, image: Image { width: rendered.width, height: rendered.height, pixels: rendered.samples }, truth }
    }
}

impl Shot {
    /// The picture in eight bits.
    pub fn eight(&self) -> Image<u8> {
        let pixels = self.image.pixels.iter().map(|&v| ((u32::from(v) + 128) / 257) as u8).collect();
        Image { width: self.image.width, height: self.image.height, pixels }
    }

    /// Eight bits, each pixel changed by its place and value.
    pub fn changed(&self, change: impl Fn(usize, usize, u8) -> u8) -> Picture {
        let mut image = self.eight();
        let width = image.width;
        for (k, value) in image.pixels.iter_mut().enumerate() {
            *value = change(k % width, k / width, *value);
        }
        image.into()
    }

    /// The board's corners in a picture of this shot; the reason where there are none.
    pub fn corners(&self, picture: &Picture) -> Result<Lattice<Corner>, String> {
        corners_in(picture, self.board).map_err(|refusal| refusal.reason)
    }

    /// How far corners are off. A board that looks the same after a turn may be numbered from any of its ends.
    pub fn deviations(&self, corners: &Lattice<Corner>) -> Deviations {
        let turns = (0..4).map(|quarters| corners.turned(quarters));
        let all = turns.filter(|turned| turned.columns == self.board.columns()).map(|turned| self.against(&turned));
        all.min_by(|a, b| a.rms_px.total_cmp(&b.rms_px)).unwrap()
    }

    fn against(&self, corners: &Lattice<Corner>) -> Deviations {
        let mut found = Deviations::default();
        for (col, row, corner) in corners.iter().filter(|(_, _, corner)| corner.used) {
            let d = corner.px - self.truth[self.board.index(col, row)];
            let inverse = corner.covariance_px2.unwrap().try_inverse().unwrap();
            let square = (d.transpose() * inverse * d)[0];
            found.used += 1;
            found.rms_px += d.norm_squared();
            found.most_sigmas = found.most_sigmas.max(square.sqrt());
            found.chi2 += square / 2.0;
        }
        found.rms_px = (found.rms_px / (2.0 * found.used as f64)).sqrt();
        found.chi2 /= found.used as f64;
        found
    }
}

/// What became of a board's corners.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deviations {
    /// Corners with a covariance.
    pub used: usize,
    /// RMS deviation of a coordinate, px.
    pub rms_px: f64,
    /// Largest deviation, in the corner's own sigmas.
    pub most_sigmas: f64,
    /// Mean square deviation of a coordinate, in its own sigmas.
    pub chi2: f64,
}

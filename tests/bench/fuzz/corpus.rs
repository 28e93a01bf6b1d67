//! What the fuzzing starts from: files made by the program's own writers.

use camino::Utf8Path;
use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, Rgb};
use nalgebra::Vector3;
use stereocal::files::OutDir;
use stereocal::formats::export::{file_storage, kalibr, mrcal, ros};
use stereocal::geometry::transform;
use stereocal::simulate::settings::Settings;
use stereocal::simulate::truth_files;
use stereocal::simulate::world::World;
use stereocal::stereo::{Camera, Lens, Rig};

/// Files of a kind.
pub type Files = Vec<Vec<u8>>;

/// A small world's files, by the names that `simulate` gives them.
pub struct Written(Vec<(&'static str, Vec<u8>)>);

/// Lines of a table that are kept: what a reader does with a line it does with all.
const LINES: usize = 30;

impl Written {
    /// Writes them into `folder`.
    pub fn new(folder: &Utf8Path) -> Written {
        let settings = Settings {
            size_px: 640,
            check_pairs: 2,
            samples: 12,
            verify: 4,
            point_noise_mm: 0.01,
            ..Settings::small()
        };
        let world = World::new(settings, None).expect("the small world");
        let names = [
            "poses/poses.csv",
            "robot.toml",
            "truth/robot.toml",
            "truth/calibration.json",
            "truth/corners.csv",
            "truth/measurements.csv",
        ];
        let whole = folder.join("whole");
        truth_files::write(&world, &OutDir::open(&whole).expect("a folder")).expect("written");
        let points = folder.join("points");
        truth_files::write_points_only(&world, &OutDir::open(&points).expect("a folder")).expect("written");
        let mut files: Vec<(&'static str, Vec<u8>)> =
            names.map(|name| (name, std::fs::read(whole.join(name)).expect("it was written"))).into();
        files.push(("measurements.csv", std::fs::read(points.join("measurements.csv")).expect("it was written")));
        Written(files)
    }

    /// The files whose names end so; of tables the first lines.
    pub fn named(&self, end: &str) -> Files {
        let files = self.0.iter().filter(|(name, _)| name.ends_with(end));
        files
            .map(|(name, bytes)| match name.ends_with(".csv") {
                true => bytes.split_inclusive(|b| *b == b'\n').take(LINES).collect::<Vec<_>>().concat(),
                false => bytes.clone(),
            })
            .collect()
    }
}

/// A rig whose lens every format can say.
fn rig() -> Rig {
    let mut left = Camera::pinhole(1280, 1024, 1500.0);
    left.lens = Lens::Brown4;
    left.distortion[0] = -0.1;
    let right_from_left = transform(Vector3::new(0.01, -0.3, 0.02), Vector3::new(-180.0, 1.0, 20.0));
    Rig { left, right: left, right_from_left, covariance: None }
}

/// Calibrations in the formats of one file, or of the left of two.
pub fn exported(format: &str) -> Files {
    let rig = rig();
    let files = match format {
        "opencv" => file_storage::files(&rig).unwrap_or_default(),
        "ros" => ros::files(&rig).expect("a lens that ROS knows"),
        "kalibr" => kalibr::files(&rig).expect("a lens that Kalibr knows"),
        _ => mrcal::files(&rig).expect("a lens that mrcal knows"),
    };
    files.into_iter().map(|file| file.text.into_bytes()).collect()
}

/// Settings, every section of them.
pub fn settings() -> Files {
    let text = "out = \"out\"\ntolerance_mm = 0.05\n[check_board]\nsquares = \"20x20\"\nsquare_mm = 10.0\n[target_board]\nsquares = \"7x6\"\n\
                square_mm = 10.0\n[identify]\nmethod = \"trust-region\"\nbound_mm = 1.0\nfolds = 5\n[identify.trust_region]\niterations = 100\n\
                [identify.swarm]\nparticles = 100\napso_inertia = [0.4, 0.9]\n[identify.swarm.stapso]\nsine_cosine_a = 2.0\n";
    vec![text.as_bytes().to_vec()]
}

/// Pictures of a format: grey and colour, 8 and 16 bit, where the format has them.
pub fn pictures(format: ImageFormat) -> Files {
    let (width, height) = (37, 29);
    let shade = |x: u32, y: u32| if (x / 6 + y / 6).is_multiple_of(2) { 40u8 } else { 210 };
    let grey = DynamicImage::from(GrayImage::from_fn(width, height, |x, y| Luma([shade(x, y)])));
    let colour = DynamicImage::from(ImageBuffer::from_fn(width, height, |x, y| Rgb([shade(x, y), shade(y, x), 90u8])));
    let deep: ImageBuffer<Luma<u16>, Vec<u16>> =
        ImageBuffer::from_fn(width, height, |x, y| Luma([u16::from(shade(x, y)) << 7]));
    let encoded = |picture: &DynamicImage| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).ok().map(|()| bytes.into_inner())
    };
    [grey, colour, DynamicImage::from(deep)].iter().filter_map(encoded).collect()
}

//! The guide's pictures of boards: rendered here, and read by the program, so that what the pages say of them is so.
//! `STEREOCAL_REFRESH=1` writes the files anew.

use std::path::{Path, PathBuf};

use crate::planted_faults::matrix::picture_faults::{PictureFault, Shares};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, GrayImage, ImageEncoder};
use stereocal::imaging::image::{Image, Picture};

use crate::run::refreshes;
use crate::shot::{Setup, Shot};

/// Side of a picture as it is taken, px; pages show half of it.
const SIZE: u32 = 640;
/// Renderings of two processors may differ by a rounding, in levels of grey.
const SAME_LEVELS: u8 = 8;

fn good() -> Setup {
    Setup {
        size: SIZE,
        squares: "12x9",
        square_mm: 14.0,
        margin_mm: 14.0,
        blur_px: 0.8,
        pose: ([0.4, -0.35, 0.12], [0.0, 0.0, 560.0]),
        ..Setup::default()
    }
}

/// What spoils a board, and what happens to its picture.
fn spoilt(name: &str) -> (Setup, Vec<PictureFault>) {
    let glare = PictureFault::Glare { at: (0.45, 0.4), radius: 0.11, add: 1.5 };
    match name {
        "good" => (good(), Vec::new()),
        "glare" => (good(), vec![glare]),
        "cut" => (Setup { pose: ([0.4, -0.35, 0.12], [130.0, 115.0, 560.0]), ..good() }, Vec::new()),
        "blurred" => (Setup { blur_px: 5.0, ..good() }, Vec::new()),
        "dark" => (Setup { electrons: (400.0, 15.0), exposure: 0.3, ..good() }, Vec::new()),
        "small" => (Setup { pose: ([0.4, -0.35, 0.12], [0.0, 0.0, 2400.0]), ..good() }, Vec::new()),
        _ => panic!("no picture {name}"),
    }
}

fn taken((setup, faults): &(Setup, Vec<PictureFault>)) -> (Shot, GrayImage) {
    let shot = setup.take();
    let (width, height) = (shot.image.width, shot.image.height);
    let values = shot.image.pixels.iter().map(|&v| f32::from(v) / f32::from(u16::MAX)).collect();
    let mut shares = Shares { width, height, values };
    faults.iter().for_each(|fault| shares.suffer(fault, 1, 0));
    let pixels = shares.values.iter().map(|v| (v * 255.0 + 0.5).clamp(0.0, 255.0) as u8).collect();
    (shot, GrayImage::from_raw(width as u32, height as u32, pixels).unwrap())
}

/// A picture for a page: smaller by a factor, in 32 greys, which keeps the file small.
fn reduced(picture: &GrayImage, factor: u32) -> GrayImage {
    GrayImage::from_fn(picture.width() / factor, picture.height() / factor, |x, y| {
        let block = (0..factor * factor).map(|k| (factor * x + k % factor, factor * y + k / factor));
        let sum: u32 = block.map(|(x, y)| u32::from(picture.get_pixel(x, y).0[0])).sum();
        image::Luma([(sum / (factor * factor)) as u8 & 0xF8])
    })
}

fn stands_in_the_guide(name: &str, picture: &GrayImage) {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/guide/pictures/{name}.png"));
    if refreshes() {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
            .write_image(picture.as_raw(), picture.width(), picture.height(), ExtendedColorType::L8)
            .unwrap();
        std::fs::write(&path, bytes).unwrap();
    }
    let stored = image::open(&path).unwrap().to_luma8();
    assert_eq!(stored.dimensions(), picture.dimensions(), "{name}");
    let far = stored.as_raw().iter().zip(picture.as_raw()).filter(|(a, b)| a.abs_diff(**b) > SAME_LEVELS).count();
    assert!(far == 0, "{name}: {far} pixels differ; STEREOCAL_REFRESH=1 writes the picture anew");
}

/// Corners with a covariance, and how far they are off, RMS of a coordinate in px; the reason where the board is not
/// read.
fn read((shot, picture): &(Shot, GrayImage)) -> Result<(usize, f64), String> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let picture = Picture::from(Image { width, height, pixels: picture.as_raw().clone() });
    let corners = shot.corners(&picture)?;
    let known = corners.iter().filter(|(_, _, corner)| corner.covariance_px2.is_some()).count();
    Ok((known, shot.deviations(&corners).rms_px))
}

#[test]
fn the_boards_of_the_guide_are_what_it_says_of_them() {
    let [good, glare, cut, blurred, dark, small] = ["good", "glare", "cut", "blurred", "dark", "small"].map(|name| {
        let picture = taken(&spoilt(name));
        stands_in_the_guide(name, &reduced(&picture.1, 2));
        let found = read(&picture);
        println!("{name}: {found:?}");
        found
    });
    // What page `boards` says of each.
    let (corners, good_px) = good.unwrap();
    assert!(corners == 88 && good_px < 0.005, "{corners} {good_px}");
    let (left, _) = glare.unwrap();
    assert!(left < 2 * corners / 3, "{left}");
    assert!(cut.is_err(), "{cut:?}");
    for (found, times) in [(blurred, 3.0), (dark, 10.0), (small, 2.0)] {
        assert!(found.as_ref().is_err() || found.as_ref().is_ok_and(|(_, px)| *px > times * good_px), "{found:?}");
    }
}

#[test]
fn the_spread_of_the_guide_is_as_it_says() {
    let near_and_far = [
        ([0.5, 0.0, 0.1], [-25.0, -20.0, 520.0]),
        ([-0.5, 0.1, 0.0], [30.0, 25.0, 560.0]),
        ([0.0, 0.55, 1.57], [-20.0, 0.0, 640.0]),
        ([0.1, -0.55, -0.1], [35.0, -30.0, 500.0]),
        ([0.35, 0.35, 0.8], [0.0, 20.0, 700.0]),
        ([-0.3, -0.35, 3.0], [-40.0, 35.0, 590.0]),
    ];
    let alike = [-12.0, -4.0, 4.0, 12.0, 0.0, 8.0].map(|x| ([0.02, 0.03, 0.01], [x, 0.5 * x - 3.0, 600.0]));
    for (name, poses) in [("spread", near_and_far), ("alike", alike)] {
        let small = SIZE / 4;
        let mut sheet = GrayImage::from_pixel(3 * small + 8, 2 * small + 4, image::Luma([0xF8]));
        for (k, pose) in poses.into_iter().enumerate() {
            let (_, picture) = taken(&(Setup { pose, ..good() }, Vec::new()));
            let (x, y) = ((small + 4) * (k as u32 % 3), (small + 4) * (k as u32 / 3));
            image::imageops::replace(&mut sheet, &reduced(&picture, 4), x.into(), y.into());
        }
        stands_in_the_guide(name, &sheet);
    }
}

//! Golden pictures: what imaging finds in clean and in damaged pictures, as the program itself once wrote it
//! (`golden_corners.txt`, `golden_damaged.txt`).
//!
//! Corners of clean pictures are what everything else builds on; a change that is meant for damaged pictures must not
//! move them. The text has every bit of every number: `STEREOCAL_GOLDEN=/tmp` writes the present ones, which are the
//! same bytes on the machine that wrote the golden ones. The test itself allows a fiftieth of a sigma: the system's
//! sine, cosine and exponential may differ in their last bit from processor to processor, which now and then rounds a
//! grey value of a rendered picture the other way.

use std::fmt::Write;

use stereocal::imaging::Corner;
use stereocal::imaging::lattice::Lattice;

use crate::damaged_corners::small_picture;
use crate::shot::Setup;

/// Most by which a place may differ from the golden one, as a share of its standard deviation, and a covariance, as a
/// share of itself.
const MOST_SIGMAS: f64 = 0.02;

/// Boards, sizes, blurs and noise of clean pictures.
fn clean() -> Vec<(&'static str, Setup)> {
    let webcam = Setup { size: 480, squares: "9x7", square_mm: 22.0, margin_mm: 22.0, ..Setup::default() };
    vec![
        ("webcam", Setup { electrons: (4000.0, 12.0), ..webcam.clone() }),
        ("dim-and-noisy", Setup { exposure: 0.3, electrons: (900.0, 8.0), ..webcam.clone() }),
        ("blurred", Setup { blur_px: 2.2, pose: ([-0.4, 0.3, -0.5], [5.0, 3.0, 560.0]), ..webcam.clone() }),
        ("sharp-and-oblique", Setup { blur_px: 0.45, pose: ([0.7, 0.35, 0.2], [-6.0, 8.0, 600.0]), ..webcam }),
        ("small-squares", Setup { size: 640, squares: "12x9", square_mm: 7.0, ..Setup::default() }),
        ("large", Setup { size: 2400, squares: "7x6", square_mm: 22.0, ..Setup::default() }),
    ]
}

/// Kinds of damaged pictures.
const DAMAGED: [&str; 5] = ["JPEG 75", "sharpened", "clipped", "glare", "cut to 0.3"];

/// Name, column, row, place and covariance of each corner that has one, a line each.
fn write(text: &mut String, name: &str, corners: &Lattice<Corner>) {
    for (col, row, c) in corners.iter() {
        if let Some(s) = c.covariance_px2 {
            let (name, x, y) = (name.replace(' ', "-"), c.px.x, c.px.y);
            writeln!(text, "{name} {col} {row} {x} {y} {} {} {}", s[(0, 0)], s[(0, 1)], s[(1, 1)]).unwrap();
        }
    }
}

fn numbers(line: &str) -> [f64; 7] {
    let numbers: Vec<f64> = line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

fn same(golden: &str, now: &str, file: &str) {
    if let Ok(folder) = std::env::var("STEREOCAL_GOLDEN") {
        std::fs::write(format!("{folder}/{file}"), now).unwrap();
    }
    assert_eq!(golden.lines().count(), now.lines().count());
    for (golden, now) in golden.lines().zip(now.lines()) {
        assert_eq!(golden.split(' ').next(), now.split(' ').next());
        let [col, row, x, y, xx, xy, yy] = numbers(golden);
        let [col1, row1, x1, y1, xx1, xy1, yy1] = numbers(now);
        let place = (x1 - x).abs().max((y1 - y).abs()) / xx.min(yy).sqrt();
        let covariance = (xx1 - xx).abs().max((xy1 - xy).abs()).max((yy1 - yy).abs()) / xx.min(yy);
        assert!((col, row) == (col1, row1) && place < MOST_SIGMAS && covariance < MOST_SIGMAS, "{golden}\n{now}");
    }
}

#[test]
fn corners_of_clean_pictures_stay_where_they_are() {
    let mut now = String::new();
    for (name, setup) in clean() {
        let shot = setup.take();
        let corners = shot.corners(&shot.eight().into()).unwrap_or_else(|reason| panic!("{name}: {reason}"));
        assert!(corners.iter().all(|(_, _, c)| c.covariance_px2.is_some()), "{name}");
        write(&mut now, name, &corners);
    }
    same(include_str!("golden_corners.txt"), &now, "golden_corners.txt");
}

#[test]
fn corners_of_damaged_pictures_stay_where_they_are() {
    let mut now = String::new();
    for name in DAMAGED {
        let (shot, picture) = small_picture(name);
        let corners = shot.corners(&picture).unwrap_or_else(|reason| panic!("{name}: {reason}"));
        write(&mut now, name, &corners);
    }
    same(include_str!("golden_damaged.txt"), &now, "golden_damaged.txt");
}

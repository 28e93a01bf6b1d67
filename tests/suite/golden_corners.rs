//! Golden pictures: what imaging finds in clean pictures, as the program itself once wrote it (`golden_corners.txt`).
//!
//! Corners of clean pictures are what everything else builds on; a change that is meant for damaged pictures must not move them. The text has
//! every bit of every number: `STEREOCAL_GOLDEN=/tmp/now.txt` writes the present ones, which are the same bytes on the machine that wrote
//! the golden ones. The test itself allows a fiftieth of a sigma: the system's sine, cosine and exponential may differ in their last bit from
//! processor to processor, which now and then rounds a grey value of a rendered picture the other way.

use std::fmt::Write;

use crate::shot::Setup;

/// Most by which a place may differ from the golden one, as a share of its standard deviation, and a covariance, as a share of itself.
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

/// Name, column, row, place and covariance of each corner, a line each.
fn written() -> String {
    let mut text = String::new();
    for (name, setup) in clean() {
        let shot = setup.take();
        let corners = shot.corners(&shot.eight().into()).unwrap_or_else(|reason| panic!("{name}: {reason}"));
        for (col, row, c) in corners.iter() {
            let s = c.covariance_px2.unwrap_or_else(|| panic!("{name}: {col} {row} has no covariance"));
            let (x, y) = (c.px.x, c.px.y);
            writeln!(text, "{name} {col} {row} {x} {y} {} {} {}", s[(0, 0)], s[(0, 1)], s[(1, 1)]).unwrap();
        }
    }
    text
}

fn numbers(line: &str) -> [f64; 7] {
    let numbers: Vec<f64> = line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

#[test]
fn corners_of_clean_pictures_stay_where_they_are() {
    let (golden, now) = (include_str!("golden_corners.txt"), written());
    if let Ok(file) = std::env::var("STEREOCAL_GOLDEN") {
        std::fs::write(file, &now).unwrap();
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

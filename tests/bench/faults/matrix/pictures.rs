//! Pictures with defects: sensor, light, things in the way, files.

use super::picture_faults::{FileForm, PictureFault};
use nalgebra::{Point2, Vector3};
use stereocal::geometry::transform;
use stereocal::simulate::picture::patch::{Patch, Tone};

use super::set::{Plan, Set};
use super::{Case, Right, case};

pub fn cases() -> Vec<Case> {
    let mut list = sensor();
    list.extend(stray_light());
    list.extend(covered());
    list.extend(files());
    list
}

fn with_fault(set: Set, pairs: std::ops::Range<usize>, fault: PictureFault) -> Set {
    set.pairs_in(pairs, |_, pair| pair.sides.iter_mut().for_each(|side| side.faults.push(fault)))
}

fn planted(
    class: &'static str,
    name: &'static str,
    size: impl Into<String>,
    right: Right,
    fault: PictureFault,
) -> Case {
    case(class, name, size, right, move |seed, px| with_fault(Plan::usual(seed, px).set(), 0..12, fault))
}

fn sensor() -> Vec<Case> {
    let sixteen_bits = |count: usize| {
        case("sensor", "hot pixels of 16 bits, dim", format!("{count}"), Right::Pass, move |seed, px| {
            let dim = PictureFault::Levels { black: 0.0, white: 0.06 };
            let set = with_fault(Plan::usual(seed, px).set(), 0..12, dim);
            let set = set.each(|picture| picture.form = FileForm::Png { bits: 16, low: false });
            with_fault(set, 0..12, PictureFault::HotPixels { count, level: 1.0 })
        })
    };
    let clip = |level: f32| {
        planted("sensor", "clipped below full scale", format!("{level}"), Right::Pass, PictureFault::ClipAt(level))
    };
    let columns = |add: f32| {
        let fault = PictureFault::HotColumn { at: 0.47, add };
        planted("sensor", "hot column", format!("{add}"), Right::Pass, fault)
    };
    vec![
        planted("sensor", "hot pixels", "20", Right::Pass, PictureFault::HotPixels { count: 20, level: 1.0 }),
        planted("sensor", "hot pixels", "1000", Right::Pass, PictureFault::HotPixels { count: 1000, level: 1.0 }),
        sixteen_bits(1),
        sixteen_bits(100),
        columns(0.1),
        columns(0.5).also_large(),
        clip(0.7),
        clip(0.5),
        case("sensor", "clipped colour channel", "", Right::Pass, |seed, px| {
            Plan::usual(seed, px).set().each(|picture| picture.form = FileForm::Colour([1.5, 1.0, 0.8]))
        }),
        case("sensor", "Bayer mosaic", "grey light", Right::Truth, |seed, px| {
            with_fault(Plan::usual(seed, px).set(), 0..12, PictureFault::Bayer([0.9, 1.0, 0.8]))
        }),
        case("sensor", "Bayer mosaic", "red light", Right::Truth, |seed, px| {
            with_fault(Plan::usual(seed, px).set(), 0..12, PictureFault::Bayer([1.0, 0.6, 0.35]))
        }),
    ]
}

fn stray_light() -> Vec<Case> {
    let glare = |add: f32, radius: f64, count: usize| {
        let size = format!("{add} in {count} of 12");
        case("light", "glare", size, Right::Pass, move |seed, px| {
            with_fault(Plan::usual(seed, px).set(), 0..count, PictureFault::Glare { at: (0.42, 0.55), radius, add })
        })
    };
    let shadow = |soft_px: f64, loss: f32| {
        case("light", "shadow's edge", format!("{soft_px} px, {loss}"), Right::Pass, move |seed, px| {
            let fault = PictureFault::Shadow { at: (0.5, 0.45), along_rad: 0.4, soft_px, loss };
            with_fault(Plan::usual(seed, px).set(), 0..6, fault)
        })
    };
    vec![glare(0.5, 0.08, 6), glare(2.0, 0.05, 12).also_large(), shadow(1.0, 0.5), shadow(8.0, 0.5), shadow(40.0, 0.7)]
}

/// A rectangle before or on the board, mm.
fn rectangle(x: (f64, f64), y: (f64, f64), z_mm: f64, lean_rad: f64, value: f64) -> Patch {
    let middle = Vector3::new((x.0 + x.1) / 2.0, (y.0 + y.1) / 2.0, z_mm);
    let (w, h) = ((x.1 - x.0) / 2.0, (y.1 - y.0) / 2.0);
    let corners_mm = [(-w, -h), (w, -h), (w, h), (-w, h)].map(|(x, y)| Point2::new(x, y)).to_vec();
    Patch { parent_from_patch: transform(Vector3::z() * lean_rad, middle), corners_mm, tone: Tone::flat(value) }
}

fn covered() -> Vec<Case> {
    let with = |name, size: String, pairs: std::ops::Range<usize>, patches: Vec<Patch>| {
        case("covered", name, size, Right::Pass, move |seed, px| {
            Plan::ceramic(seed, px).set().reboard(pairs.clone(), |_, board| {
                let mut board = board.clone();
                board.covers.extend(patches.clone());
                board
            })
        })
        .also_large()
    };
    let hand = |width: f64, count: usize| {
        with(
            "hand",
            format!("{width} mm in {count} of 12"),
            0..count,
            vec![rectangle((-130.0, -30.0), (20.0, 20.0 + width), -15.0, 0.3, 0.4)],
        )
    };
    // White paper over half of each of several black squares, and black over part of white ones.
    let halves = |share: f64, count: usize| {
        let squares = [(4, 4), (9, 7), (13, 5), (6, 12), (15, 14), (10, 10)];
        let patches = squares.map(|(i, j)| {
            let (x, y) = (f64::from(i) * 10.0 - 100.0, f64::from(j) * 10.0 - 100.0);
            let value = if (i + j) % 2 == 0 { 1.0 } else { 0.07 };
            rectangle((x, x + 10.0 * share), (y, y + 10.0), -0.01, 0.0, value)
        });
        with("half-hidden squares", format!("{share} in {count} of 12"), 0..count, patches.to_vec())
    };
    let misprint = |um: f64| {
        // A strip of black along one side of some squares: the line stands off.
        let patches = (2..17).step_by(3).map(|i| {
            let i = f64::from(i) * 10.0 - 100.0;
            rectangle((i, i + um * 1e-3), (-100.0, 100.0), -0.001, 0.0, 0.07)
        });
        with("line too wide", format!("{um} um"), 0..12, patches.collect())
    };
    vec![
        hand(15.0, 4),
        hand(60.0, 12),
        halves(0.5, 12),
        halves(0.2, 12),
        halves(0.8, 4),
        misprint(100.0),
        misprint(500.0),
    ]
}

fn files() -> Vec<Case> {
    let jpeg = |quality: u8, keep: f64, pairs: std::ops::Range<usize>, right| {
        let size = format!("quality {quality}, {:.0} % of {} pairs' files", 100.0 * keep, pairs.len());
        case("file", "JPEG", size, right, move |seed, px| {
            let set = Plan::usual(seed, px).set();
            let set = set.each(|picture| picture.form = FileForm::Jpeg { quality, keep: 1.0 });
            set.pairs_in(pairs.clone(), |_, pair| {
                pair.sides.iter_mut().for_each(|side| side.form = FileForm::Jpeg { quality, keep });
            })
        })
    };
    vec![
        jpeg(90, 1.0, 0..12, Right::Pass),
        jpeg(30, 1.0, 0..12, Right::Pass).also_large(),
        jpeg(90, 0.7, 0..12, Right::Truth),
        jpeg(90, 0.7, 2..4, Right::Pass),
        jpeg(90, 0.95, 2..4, Right::Pass),
    ]
}

//! Faults of single poses: each is a row with its reason, and the others are measured.

use std::path::Path;

use super::super::picture_faults::{FileForm, PictureFault};
use nalgebra::{Point2, Vector3};
use stereocal::geometry::transform;
use stereocal::simulate::picture::patch::{Patch, Tone};

use super::session::{Session, Spoil};
use super::{Expected, MeasureCase, case};

/// The pose that is spoilt.
const BAD: usize = 5;

fn bad(fault: &'static str, size: impl Into<String>, change: impl Fn(Session) -> Session + 'static) -> MeasureCase {
    case(fault, size, Expected::Named(vec![BAD]), change)
}

pub fn cases() -> Vec<MeasureCase> {
    let mut list = places();
    list.extend(pictures());
    list.extend(files());
    list
}

fn places() -> Vec<MeasureCase> {
    let mut list = Vec::new();
    for mm in [0.05, 0.2, 1.0, 20.0] {
        list.push(bad("pose out of step", format!("{mm} mm"), move |session| {
            session.pairs_in(BAD..BAD + 1, |pair| {
                let side = &mut pair.sides[1];
                side.camera_from_board =
                    transform(Vector3::zeros(), Vector3::new(0.6, 0.64, 0.48) * mm) * side.camera_from_board;
            })
        }));
    }
    let moved = |session: Session, by: Vector3<f64>, about: Vector3<f64>| {
        let rig = session.plan.drawing.rig();
        session.pairs_in(BAD..BAD + 1, |pair| {
            let at =
                transform(Vector3::zeros(), by) * pair.sides[0].camera_from_board * transform(about, Vector3::zeros());
            pair.place(at, &rig.right_from_left);
        })
    };
    for mm in [70.0, 110.0, 200.0] {
        list.push(bad("out of view", format!("by {mm} mm"), move |session| {
            moved(session, Vector3::new(mm, 0.0, 0.0), Vector3::zeros())
        }));
    }
    for deg in [50.0, 70.0, 85.0] {
        list.push(bad("tilted", format!("by {deg} deg"), move |session| {
            moved(session, Vector3::zeros(), Vector3::new(f64::to_radians(deg), 0.0, 0.0))
        }));
    }
    list.push(bad("another pose's picture", "right", |mut session| {
        session.pairs[BAD].sides[1] = session.pairs[BAD + 1].sides[1].clone();
        session
    }));
    list.push(case(
        "two poses exchanged their right pictures",
        "",
        Expected::Named(vec![BAD, BAD + 1]),
        |mut session| {
            let other = session.pairs[BAD].sides[1].clone();
            session.pairs[BAD].sides[1] = std::mem::replace(&mut session.pairs[BAD + 1].sides[1], other);
            session
        },
    ));
    list.push(bad("cameras exchanged", "one pose", |session| {
        session.pairs_in(BAD..BAD + 1, |pair| pair.sides.reverse())
    }));
    list
}

fn pictures() -> Vec<MeasureCase> {
    let mut list = Vec::new();
    for px in [3.0, 8.0, 20.0] {
        list.push(bad("blurred", format!("{px} px"), move |session| {
            session.pairs_in(BAD..BAD + 1, |pair| pair.sides[0].optics.gaussian_px = px)
        }));
    }
    for mm in [10.0, 25.0, 60.0] {
        list.push(bad("hidden by a finger", format!("{mm} mm"), move |session| {
            let (w, h) = (40.0, mm / 2.0);
            let finger = Patch {
                parent_from_patch: transform(Vector3::z() * 0.2, Vector3::new(-25.0, 5.0, -6.0)),
                corners_mm: [(-w, -h), (w, -h), (w, h), (-w, h)].map(|(x, y)| Point2::new(x, y)).to_vec(),
                tone: Tone::flat(0.4),
            };
            session.pairs_in(BAD..BAD + 1, |pair| {
                let mut board = (*pair.sides[0].board).clone();
                board.covers.push(finger.clone());
                let board = std::sync::Arc::new(board);
                pair.sides.iter_mut().for_each(|side| side.board = board.clone());
            })
        }));
    }
    for add in [0.2, 0.6, 3.0] {
        list.push(bad("glare", format!("{add}"), move |session| {
            session.pairs_in(BAD..BAD + 1, |pair| {
                let board = pair.sides[0].corners_px();
                let middle = board[board.len() / 2];
                let px = f64::from(pair.sides[0].camera.width);
                let at = (middle.x / px, middle.y / px);
                pair.sides[0].faults.push(PictureFault::Glare { at, radius: 0.03, add });
            })
        }));
    }
    list
}

fn files() -> Vec<MeasureCase> {
    let spoilt = |fault, size: &str, spoil: Spoil| {
        bad(fault, size, move |mut session| {
            session.spoilt.push((BAD, 1, spoil));
            session
        })
    };
    // The file is a link to a picture that other cases use: it is replaced, not written to.
    fn replace(path: &Path, bytes: &[u8]) {
        std::fs::remove_file(path).expect("a file");
        std::fs::write(path, bytes).expect("a file");
    }
    fn cut(path: &Path, share: f64) {
        let bytes = std::fs::read(path).expect("a file");
        replace(path, &bytes[..(bytes.len() as f64 * share) as usize]);
    }
    let mut list = vec![
        spoilt("unreadable", "no picture", |path| replace(path, b"this is no picture")),
        spoilt("unreadable", "empty", |path| replace(path, b"")),
        spoilt("unreadable", "missing", |path| std::fs::remove_file(path).expect("a file")),
        spoilt("cut off", "PNG at 95 %", |path| cut(path, 0.95)),
        spoilt("cut off", "PNG at 30 %", |path| cut(path, 0.3)),
    ];
    for keep in [0.95, 0.7, 0.3] {
        list.push(bad("cut off", format!("JPEG at {:.0} %", 100.0 * keep), move |session| {
            session.pairs_in(BAD..BAD + 1, |pair| pair.sides[1].form = FileForm::Jpeg { quality: 90, keep })
        }));
    }
    list
}

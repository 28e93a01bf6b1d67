//! Faults that all poses share: the rig changed since its calibration, the target is not the typed one, files mixed up.

use nalgebra::Vector3;
use serde_json::{Value, json};
use stereocal::geometry::{Transform, transform};

use super::session::Session;
use super::{Expected, MeasureCase, case};

fn right_moved(session: Session, from: usize, by: Transform) -> Session {
    let end = session.pairs.len();
    session.pairs_in(from..end, |pair| {
        pair.sides[1].camera_from_board = by * pair.sides[1].camera_from_board;
    })
}

fn turn(pitch_deg: f64, yaw_deg: f64) -> Transform {
    transform(Vector3::new(pitch_deg.to_radians(), yaw_deg.to_radians(), 0.0), Vector3::zeros())
}

fn shift(x_mm: f64) -> Transform {
    transform(Vector3::zeros(), Vector3::new(x_mm, 0.0, 0.0))
}

pub fn cases() -> Vec<MeasureCase> {
    let moved = |fault, size: String, from: usize, by: Transform| {
        case(fault, size, Expected::Said, move |session| right_moved(session, from, by))
    };
    let mut list = Vec::new();
    for deg in [0.01, 0.03, 0.1, 1.0] {
        list.push(moved("yaw since the check", format!("{deg} deg"), 0, turn(0.0, deg)));
        list.push(moved("pitch since the check", format!("{deg} deg"), 0, turn(deg, 0.0)));
    }
    for mm in [0.03, 0.1, 0.3] {
        list.push(moved("right camera moved since", format!("{mm} mm"), 0, shift(mm)));
        list.push(moved("right camera moved at pose 8", format!("{mm} mm"), 7, shift(mm)));
        list.push(moved("right camera yawed at pose 8", format!("{} deg", mm / 10.0), 7, turn(0.0, mm / 10.0)));
    }
    for percent in [0.03, 0.1, 0.3] {
        list.push(case("left focal length", format!("+{percent} %"), Expected::Said, move |session| {
            let end = session.pairs.len();
            session.pairs_in(0..end, |pair| {
                pair.sides[0].camera.fx *= 1.0 + percent / 100.0;
                pair.sides[0].camera.fy *= 1.0 + percent / 100.0;
            })
        }));
    }
    list.extend(typed());
    list.extend(files());
    list
}

/// `--square-mm` for squares of 10 mm.
fn typed() -> Vec<MeasureCase> {
    let typed = |mm: f64| {
        case("square as typed", format!("{mm} mm"), Expected::Said, move |mut session| {
            session.typed_mm = mm;
            session
        })
    };
    vec![typed(10.02), typed(10.1), typed(12.0)]
}

fn files() -> Vec<MeasureCase> {
    let edited = |fault, size: &str, edit: fn(&mut Value)| {
        case(fault, size, Expected::Said, move |mut session| {
            session.edit = Some(edit);
            session
        })
    };
    fn scaled(json: &mut Value, by: f64) {
        for k in 0..3 {
            let mm = json["right_from_left"]["translation_mm"][k].as_f64().unwrap_or(0.0);
            json["right_from_left"]["translation_mm"][k] = json!(mm * by);
        }
    }
    vec![
        edited("baseline", "in metres", |json| scaled(json, 1e-3)),
        edited("baseline", "in inches", |json| scaled(json, 1.0 / 25.4)),
        edited("baseline", "1 % long", |json| scaled(json, 1.01)),
        case("cameras exchanged", "all poses", Expected::Said, |session| {
            let end = session.pairs.len();
            session.pairs_in(0..end, |pair| pair.sides.reverse())
        }),
    ]
}

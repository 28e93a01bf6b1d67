//! Programs that are written, and read back.

use camino::Utf8Path;

use crate::programs::*;

const PULSES: [f64; 7] = [1341.4, 1341.4, 1341.4, 1000.0, 1000.0, 622.0, 500.0];

fn stops(count: usize) -> Vec<Stop> {
    let at = |k: f64| (0..count).map(|j| 12.345678 * k - 31.25 * j as f64).collect::<Vec<f64>>();
    let stop = |k: usize| Stop { name: format!("g1_{k:03}"), readings: at(k as f64), approach: at(k as f64 - 0.2) };
    (0..5).map(stop).collect()
}

/// deg; pulses are whole.
fn same(a: &[f64], b: &[f64], by: f64) {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < by), "{a:?} {b:?}");
}

#[test]
fn what_is_written_is_read_and_put_back_in_place() {
    let motion = Motion { speed_percent: 20.0, dwell_s: 1.5 };
    for (language, pulses) in Language::ALL.map(|l| (l, false)).into_iter().chain([(Language::Jbi, true)]) {
        for count in [6, 7] {
            let slides = vec![false; count];
            let pulses_per_deg: &[f64] = if pulses { &PULSES[..count] } else { &[] };
            let joints = Joints { slides: &slides, pulses_per_deg };
            let stops = stops(count);
            let (name, text) = program(language, "plan", &stops, &motion, joints).swap_remove(0);
            assert_eq!(Language::of(Utf8Path::new(&name)), Some(language), "{name}");
            let read = targets(language, &text, joints).unwrap();
            let by = if pulses { 1e-3 } else { 1e-6 };
            assert_eq!(read.len(), 10, "{language:?} {text}");
            for (k, stop) in stops.iter().enumerate() {
                same(&read[2 * k].readings, &stop.approach, by);
                same(&read[2 * k + 1].readings, &stop.readings, by);
            }
            // Nothing changed is nothing changed; one target changed leaves all other bytes.
            assert_eq!(with_readings(language, &text, joints, &[]), text);
            let other: Vec<f64> = read[3].readings.iter().map(|r| r + 0.5).collect();
            let changed = with_readings(language, &text, joints, &[(&read[3], other.clone())]);
            let again = targets(language, &changed, joints).unwrap();
            same(&again[3].readings, &other, by);
            assert_eq!(again[4].readings, read[4].readings);
            let differ = text.lines().zip(changed.lines()).filter(|(a, b)| a != b).count();
            assert!(differ <= 7 && text.lines().count() == changed.lines().count(), "{language:?}: {differ}");
        }
    }
}

/// `d2r` stays where it is, with other degrees in it.
#[test]
fn degrees_of_urscript_stay_degrees() {
    let joints = Joints { slides: &[false; 6], pulses_per_deg: &[] };
    let text = "movej([d2r(-90), 0.5, d2r( 10 ), 0, 0, d2r(0)], a=1)\n";
    let target = targets(Language::UrScript, text, joints).unwrap().swap_remove(0);
    same(&target.readings, &[-90.0, 0.5f64.to_degrees(), 10.0, 0.0, 0.0, 0.0], 1e-9);
    let changed =
        with_readings(Language::UrScript, text, joints, &[(&target, vec![-91.0, 30.0, 11.5, 0.0, 0.0, -1.0])]);
    assert_eq!(
        changed,
        "movej([d2r(-91.0000000), 0.523598776, d2r(11.5000000), 0.000000000, 0.000000000, d2r(-1.0000000)], a=1)\n"
    );
}

#[test]
fn poses_and_comments_are_no_joint_targets() {
    let slides = [false; 6];
    let joints = Joints { slides: &slides, pulses_per_deg: &[] };
    for (language, text) in [
        (Language::UrScript, "# movej([1,2,3,4,5,6])\nmovel(p[0.1,0.2,0.3,0,3.1,0], a=1, v=1)\ng = [1,2,3,4,5,6]\n"),
        (Language::Rapid, "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;\n"),
        (Language::Krl, ";PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"),
        (
            Language::FanucLs,
            "/POS\nP[1]{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 1.0 mm, Y = 2 mm\n};\n",
        ),
        (Language::Jbi, "///POSTYPE BASE\n///RECTAN\nC00000=1,2,3,4,5,6\n"),
    ] {
        assert_eq!(targets(language, text, joints).unwrap(), [], "{text}");
    }
    let said = targets(Language::Jbi, "///POSTYPE PULSE\nC00000=1,2,3,4,5,6\n", joints).unwrap_err();
    assert!(said.contains("pulses a degree of each of the 6 joints"), "{said}");
}

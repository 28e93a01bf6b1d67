use super::*;
use crate::geometry::transform;
use crate::stereo::judge::verdict::Verdict;

/// Two plain cameras side by side, one of whose numbers is uncertain.
fn plain() -> Rig {
    Rig {
        left: Camera::pinhole(640, 480, 500.0),
        right: Camera::pinhole(640, 480, 500.0),
        right_from_left: transform(Vector3::zeros(), Vector3::new(-120.0, 0.0, 0.0)),
        covariance: Some(Covariance { order: vec!["left.fx".into()], matrix: DMatrix::from_element(1, 1, 0.5) }),
    }
}

#[test]
fn a_rig_survives_the_file() {
    let mut rig = plain();
    rig.left.distortion[0] = -0.25;
    rig.right = Camera { lens: Lens::Brown5, ..rig.left };
    rig.right.distortion[4] = 0.125;
    rig.right_from_left = transform(Vector3::new(0.01, -0.3, 0.02), Vector3::new(-120.0, 1.0, 20.0));
    let text = files::to_json(&CalibrationFile::from(&rig));
    let back = serde_json::from_str::<CalibrationFile>(&text).unwrap().rig().unwrap();
    assert_eq!(back.left, rig.left);
    assert_eq!(back.right, rig.right);
    assert_eq!(back.covariance, rig.covariance);
    assert!((back.right_from_left.to_matrix() - rig.right_from_left.to_matrix()).amax() < 1e-15);
}

#[test]
fn a_folder_stands_for_the_one_calibration_in_it() {
    let (_keep, path) = files::temporary_folder();
    let (out, usual) = (path.join("new"), path.join("out"));
    std::fs::create_dir(&usual).unwrap();
    let put = |name: &str| std::fs::write(path.join(name), "").unwrap();
    let found = || file(Some(&path), &out, &usual).map_err(|e| e.to_string());
    assert_eq!(file(None, &out, &usual).unwrap(), path.join("new/calibration.json"));
    put("out/calibration.json");
    assert_eq!(file(None, &out, &usual).unwrap(), path.join("out/calibration.json"));
    assert_eq!(file(Some(&path.join("a.json")), &out, &usual).unwrap(), path.join("a.json"));
    assert!(found().unwrap_err().contains("no calibration in this folder"));
    put("left.yaml");
    put("right.yaml");
    assert_eq!(found(), Ok(path.join("left.yaml")));
    put("camchain.yaml");
    assert!(found().unwrap_err().contains("several calibrations: left.yaml, camchain.yaml"));
    put("calibration.json");
    assert_eq!(found(), Ok(path.join("calibration.json")));
}

#[test]
fn what_is_no_rig_is_refused_by_name() {
    let good = serde_json::to_value(CalibrationFile::from(&plain())).unwrap();
    let refused = |pointer: &str, value: serde_json::Value| {
        let mut changed = good.clone();
        *changed.pointer_mut(pointer).unwrap() = value;
        serde_json::from_value::<CalibrationFile>(changed).unwrap().rig().unwrap_err()
    };
    for (pointer, value, part) in [
        ("/left/model", "fisheye".into(), "model is \"fisheye\""),
        ("/left/model", "brown5".into(), "has 4 numbers; the brown5 model has 5"),
        ("/right/distortion/2", 0.5.into(), "right camera: radial2 has 2 coefficients"),
        ("/left/width", 0.into(), "width is 0"),
        ("/right_from_left/rotation/0/0", 0.9.into(), "is not a rotation"),
        ("/right_from_left/rotation/2/2", (-1.0).into(), "is not a rotation"),
        ("/right_from_left/translation_mm/0", 0.0.into(), "0 mm apart"),
        ("/covariance/matrix/0/0", 1e308.into(), "covariance of `left.fx` is 1e308"),
        ("/version", 2.into(), "version 2"),
    ] {
        let said = refused(pointer, value);
        assert!(said.contains(part), "{pointer}: {said}");
    }
    let mut named_elsewhere = good.clone();
    named_elsewhere["left"]["model"] = "opencv".into();
    assert!(serde_json::from_value::<CalibrationFile>(named_elsewhere).unwrap().rig().is_ok());
}

#[test]
fn a_rig_that_did_not_pass_says_so_to_those_who_use_it() {
    let (_keep, path) = files::temporary("calibration.json", "");
    let doubts = |check: Option<(Verdict, Option<f64>)>, unconfirmed: &[&str]| {
        let mut file = CalibrationFile::from(&plain());
        file.check =
            check.map(|(verdict, trusted_mm)| Check { verdict, tolerance_mm: 0.05, trusted_mm, length_mm: Some(70.0) });
        file.unconfirmed = unconfirmed.iter().map(|pair| (*pair).to_owned()).collect();
        std::fs::write(&path, files::to_json(&file)).unwrap();
        let read = read(&path).unwrap();
        read.doubts().join("; ")
    };
    assert_eq!(doubts(None, &[]), "");
    assert_eq!(doubts(Some((Verdict::Pass, Some(0.0123))), &[]), "");
    assert_eq!(
        doubts(Some((Verdict::Fail, Some(1.3538))), &[]),
        "this rig did not pass its check (FAIL at a tolerance of 0.05 mm): lengths of up to 70 mm can be trusted to 1.36 mm"
    );
    assert!(
        doubts(Some((Verdict::Fail, Some(21.2))), &[])
            .ends_with("no length can be trusted: of one of 70 mm an error of 21 mm is not ruled out")
    );
    let open = doubts(Some((Verdict::Undecided, None)), &["0017"]);
    assert!(open.contains("from pair 0017 on") && open.ends_with("can be trusted is not known"), "{open}");
}

#[test]
fn how_pairs_moved_is_read_where_it_is_said() {
    let (_keep, path) = files::temporary("calibration.json", "");
    let motion = |sigmas: Option<[f64; 6]>| {
        let noise = NoiseRecord {
            factor: 1.0,
            added_px: 0.0,
            pair_excess: None,
            farthest_pair: None,
            pairs: Some(12),
            pair_motion: sigmas,
        };
        let file = CalibrationFile { corner_noise: Some(noise), ..CalibrationFile::from(&plain()) };
        std::fs::write(&path, files::to_json(&file)).unwrap();
        read(&path).unwrap().pair_motion
    };
    assert_eq!(motion(None), None);
    let sigmas = [0.5, 0.25, 2.0, 1.0, 4.0, 8.0];
    assert_eq!(motion(Some(sigmas)), Some(Vector6::from(sigmas.map(|sigma| sigma * sigma))));
    assert_eq!(motion(Some([0.5, 0.25, 0.0, 1.0, 4.0, 8.0])), None);
}

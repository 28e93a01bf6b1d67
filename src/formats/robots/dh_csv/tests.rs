use super::*;

fn all(text: &str) -> Result<Vec<Reading>> {
    let folder = tempfile::tempdir().unwrap();
    let path = camino::Utf8PathBuf::from_path_buf(folder.path().join("dh.csv")).unwrap();
    std::fs::write(&path, text).unwrap();
    readings(&path, None)
}

#[test]
fn one_table_in_all_its_forms() {
    let expected = vec![[0.0, 0.0, 0.0, 487.0], [-90.0, 85.0, -90.0, 0.0], [0.0, 640.0, 0.0, 12.5]];
    for text in [
        "alpha, a, d, theta\n0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n",
        "theta_deg;d_mm;a_mm;alpha_deg\n0;487;0;0\n-90;0;85;-90\n0;12,5;640;0\n",
        "joint,alpha [rad],a [m],theta [rad],d [m]\n1,0,0,0,0.487\n2,-1.5707963267948966,0.085,-1.5707963267948966,0\n3,0,0.64,0,0.0125\n",
        "d\ttheta\talpha\ta\n0.487\t0\t0\t0\n0\t-1.5707963267948966\t-1.5707963267948966\t0.085\n0.0125\t0\t0\t0.64\n",
    ] {
        let found = all(text).unwrap();
        assert_eq!(found.len(), 1, "{text}");
        for (row, expected) in found[0].rows.iter().zip(&expected) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{text}: {row:?}");
        }
    }
}

#[test]
fn the_ends_of_a_table_show_its_convention_where_no_word_says_it() {
    let of = |text: &str| all(text).unwrap()[0].convention();
    let classic = "theta,d,a,alpha\nq1,0.31,0,pi/2\nq2 - pi/2,0,-0.52,0\nq3,0.1,0,-pi/2\nq4,0.09,0,0\n";
    assert_eq!(of(classic), Some(Convention::Classic));
    let [alpha, a, theta, d] = all(classic).unwrap()[0].rows[1];
    assert!((alpha, a, d) == (0.0, -520.0, 0.0) && (theta + 90.0).abs() < 1e-9);
    assert_eq!(of("theta,d,a,alpha\n0,310,0,0\n-90,0,0,-90\n0,0,520,0\n0,90,0,90\n"), Some(Convention::Modified));
    // An arm in a plane, and one that stands on a slope.
    assert_eq!(of("theta,d,a,alpha\n0,310,0,0\n0,0,225,0\n0,9,0,0\n"), None);
    assert_eq!(of("theta,d,a,alpha\n0,310,0,90\n0,0,225,0\n0,9,80,0\n"), None);
    assert_eq!(of("alpha_deg,a_mm,theta_deg,d_mm\n90,0,0,310\n0,225,0,0\n0,80,0,9\n"), Some(Convention::Modified));
    assert_eq!(of("alpha_deg,a_mm,theta_deg,d_mm\n90,0,0,310\n0,225,0,0\n0,0,0,9\n"), Some(Convention::Classic));
    assert_eq!(of("theta_i,d_i,a_(i-1),alpha_{i-1}\n0,310,0,90\n0,0,225,0\n0,9,0,0\n"), Some(Convention::Modified));
    let said = |text: &str| crate::diagnostic::report(&all(text).unwrap_err());
    assert!(said(&classic.replace("q3,0.1", "0,d3")).contains("`d3` is not a number"));
    assert!(said(&classic.replace("q3,0.1", "0,q3")).contains("slides"));
    // Of rows that turn and rows that do not the last may be the flange.
    let flange = all(&format!("{classic}0,0.2,0,0\n")).unwrap();
    assert!(flange[0].rows == all(classic).unwrap()[0].rows && flange[0].said.starts_with("4 joints"));
    assert!(said(&classic.replace("q3,0.1", "0,0.1")).contains("does not turn"));
    assert!(said(&classic.replace("q2 - pi/2", "q2 - 90")).contains("in radians stand beside one of 90"));
    let words = "Link Length (a<sub>i-1</sub>),Link Twist (α<sub>i-1</sub>),Joint Offset (d<sub>i</sub>),Joint Angle (θ<sub>i</sub>)\n0,0,310,θ<sub>1</sub>\n0,-90,0,\\theta_2 - 90\n520,0,0,θ<sub>3</sub>\n";
    let found = all(words).unwrap();
    assert_eq!((found[0].rows[1], found[0].convention()), ([-90.0, 0.0, -90.0, 0.0], Some(Convention::Modified)));
}

#[test]
fn without_names_every_order_that_could_be_is_offered() {
    let found = all("0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n").unwrap();
    assert!(found.len() > 1 && found.iter().any(|r| r.columns == "alpha,a,d,theta"), "{found:?}");
    let said = |text: &str| crate::diagnostic::report(&all(text).unwrap_err());
    assert!(said("alpha_deg,a_mm,theta_deg,d_mm\n1.5708,85,0,0\n0,640,1.5708,12\n").contains("radians"));
    assert!(said("alpha_deg,a_mm,theta_deg,d_mm\n90,0.085,0,0\n0,0.640,0,0\n").contains("metres"));
    assert!(said("alpha,a,theta\n90,85,0\n0,640,0\n").contains("no column `d_mm`"));
}

use super::*;
use crate::identify::synthetic;

fn row(name: usize, role: Role, observed: Observed) -> Measurement {
    synthetic::row(format!("p{name}"), "g", role, vec![name as f64], observed)
}

fn point(x: f64) -> Observed {
    synthetic::seen_at(Point3::new(x, 0.0, 0.0))
}

#[test]
fn the_reference_is_the_row_in_the_middle() {
    let rows: Vec<_> = (0..25).map(|i| row(i, Role::Sample, point(i as f64))).collect();
    let set = Dataset::new(&rows).unwrap();
    assert_eq!((set.verify_rows().len(), set.fit_rows().len()), (0, 25));
    assert_eq!(set.reference(0, &(0..25).collect::<Vec<_>>()), Some(12));
}

#[test]
fn a_missing_row_is_named_and_a_centre_of_distances_needs_no_number() {
    let missing = Observed::Missing { reason: "no board".into() };
    let distance = Observed::Distance { distance_mm: 5.0, sigma_mm: None };
    let rows = vec![
        row(0, Role::Center, missing.clone()),
        row(1, Role::Sample, distance.clone()),
        row(2, Role::Sample, missing),
        row(3, Role::Verify, distance),
    ];
    let set = Dataset::new(&rows).unwrap();
    assert_eq!(set.groups[0].center, Some(0));
    assert_eq!(set.skipped, [Skipped { pose: "p2".into(), reason: "no board".into() }]);
}

#[test]
fn nothing_to_fit_is_said() {
    assert!(Dataset::new(&[row(0, Role::Center, point(0.0)), row(1, Role::Verify, point(1.0))]).is_err());
}

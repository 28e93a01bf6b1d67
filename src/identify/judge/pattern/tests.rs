use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{Explained, Left, is_scatter};
use crate::identify::data::dataset::Dataset;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::identify::synthetic::{identified, normal, row, seen_at};
use crate::measurements::Role;
use crate::robot::{Robot, catalogue};

/// Sixty points over much of what the joints reach.
fn measured(truth: &Robot, noise_mm: f64, seed: u64) -> Dataset {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let rows = (0..60).map(|i| {
        let joints_deg = [60.0, 40.0, 40.0, 90.0, 60.0, 120.0].map(|most| most * (2.0 * random.random::<f64>() - 1.0));
        let point_mm = truth.target_mm(&joints_deg.map(f64::to_radians)) + noise_mm * normal(&mut random);
        row(format!("p{i}"), "g", Role::Sample, joints_deg.to_vec(), seen_at(point_mm))
    });
    Dataset::new(&rows.collect::<Vec<_>>()).unwrap()
}

/// Whether what is left of robot `of` measured as `by` scatters, of six draws.
fn scattering(of: &str, by: &str, noise_mm: f64) -> usize {
    let [truth, nominal] = [of, by].map(|name| catalogue::robot(name).unwrap());
    let truth = truth.with_table_2();
    let is = |seed: &u64| {
        let set = measured(&truth, noise_mm, *seed);
        identified(&set, &nominal).formulation().is_some_and(|formulation| is_scatter(formulation, &set))
    };
    (0..6).filter(is).count()
}

#[test]
fn readings_that_scatter_by_millimetres_follow_no_joint() {
    for noise_mm in [1.0, 3.0] {
        let count = scattering("abb-irb120", "abb-irb120", noise_mm);
        assert!(count >= 5, "{noise_mm} mm: {count} of 6");
    }
}

#[test]
fn what_another_arms_file_leaves_follows_the_joints() {
    assert_eq!(scattering("abb-irb120", "ur10", 0.05), 0);
    assert_eq!(scattering("ur10", "kuka-kr6-r900", 0.05), 0);
}

/// Of points without any error nothing is left that could be explained.
#[test]
fn where_nothing_is_left_nothing_is_told() {
    let nominal = catalogue::robot("abb-irb120").unwrap();
    let set = measured(&nominal.clone().with_table_2(), 0.05, 1);
    let found = identified(&set, &nominal);
    let formulation = found.formulation().unwrap();
    let mut linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let column = |placement: &Placement| DMatrix::from_fn(placement.poses.len(), 1, |row, _| (row as f64).sin());
    let explained = |linear: &Linearised| -> Option<Explained> { Left::new(linear, 1, column)?.explained() };
    assert!(explained(&linear).is_some());
    linear.placements.iter_mut().for_each(|placement| placement.at_zero.fill(0.0));
    assert_eq!(explained(&linear), None);
}

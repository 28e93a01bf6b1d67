//! Lenses that are known and not those of the pictures.

use super::{asked, shown_by, standing};
use crate::imaging::{Corners, Side};
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::findings::Finding;
use crate::stereo::findings::standing::calibrate_standing;
use crate::stereo::model::KnownLenses;
use crate::stereo::pairs::Cause;
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{BROWN4, World};

fn with_lenses(corners: &Corners, known: KnownLenses) -> (Calibration, Vec<Finding>) {
    calibrate_standing(corners, &asked(Options { known: Some(known), ..Options::default() })).unwrap()
}

fn not_simultaneous(told: &[Finding]) -> bool {
    told.iter().any(|finding| finding.cause == Cause::NotSimultaneous.word())
}

#[test]
fn lenses_that_are_not_those_of_the_pictures_are_no_pictures_of_two_moments() {
    let world = World::new(12, 88);
    let earlier = calibrate(&World::new(12, 188).corners(188), &BROWN4).unwrap();
    let known = KnownLenses::of_rig(earlier.rig(), &Side::BOTH);
    let (found, told) = with_lenses(&world.corners(71), known.exchanged());
    let check = found.lens_check.as_ref().unwrap();
    assert_eq!(check.causes, [Cause::Exchanged]);
    assert!(check.remedy().starts_with("exchange the folders"), "{}", check.remedy());
    assert!(!not_simultaneous(&told), "{told:?}");

    // Both at once: lenses that are far off, and a rig that is another one in each pair.
    let mut other = earlier.rig().clone();
    [&mut other.left, &mut other.right]
        .into_iter()
        .for_each(|camera| (camera.fx, camera.fy) = (1.1 * camera.fx, 1.1 * camera.fy));
    let (found, told) = with_lenses(&world.corners_by_hand(71, 0.025), KnownLenses::of_rig(&other, &Side::BOTH));
    assert!(found.lens_check.as_ref().unwrap().contradicts());
    assert!(not_simultaneous(&told), "{told:?}");
}

/// What a terminal says of it is short, and the report says all.
#[test]
fn a_focus_that_hunts_is_told_in_two_lines_of_a_terminal() {
    let world = World { sigma_px: 0.01, ..World::new(24, 7) };
    let focused = |factor: f64| {
        let mut other = world.clone();
        let right = &mut other.rig.right;
        (right.fx, right.fy, right.cx) = (factor * right.fx, factor * right.fy, right.cx + 0.4);
        other
    };
    let corners = shown_by(world.corners(8), &focused(1.01), 8, 12..18);
    let (_, told) = standing(&shown_by(corners, &focused(1.006), 8, 18..24));
    let [change, ..] = &told[..] else { panic!("nothing was found") };
    let said = change.briefly();
    assert!(change.action.contains("goes on changing") && said.len() <= change.action.len().min(250), "{told:?}");
    assert!(
        ["goes on changing", "from pair 12 on", "from pair 18 on"].iter().all(|part| said.contains(part)),
        "{said}"
    );
}

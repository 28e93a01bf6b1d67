//! Boards that slid by a known length, with wrong scales, wrong lengths and turns planted, and clean ones.

use nalgebra::Vector3;

use super::stated::UNCERTAINTY_MM;
use super::*;
use crate::geometry::transform;
use crate::imaging::{Board, Corners};
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::calibrate::calibrate;
use crate::stereo::findings::Finding;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::ledger::Standards;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::pairs::Cause;
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{self, World};

const PAIRS: usize = 12;

/// Twelve pairs, and boards that slid from the last one on by lengths (mm) and turned by angles (deg); pair 11 is
/// before the first slide.
fn slid(seed: u64, steps: &[(f64, f64)]) -> World {
    let mut world = World { sigma_px: 0.02, ..World::new(PAIRS, seed) };
    let along = Vector3::new(0.8, -0.5, 0.33).normalize();
    world.poses[PAIRS - 1].translation.vector = Vector3::new(5.0, 5.0, 550.0);
    for &(mm, deg) in steps {
        let from = world.poses[world.poses.len() - 1];
        let mut to = from;
        to.translation.vector += along * mm;
        to.rotation = transform(Vector3::new(0.5, 0.2, 0.8).normalize() * deg.to_radians(), Vector3::zeros()).rotation
            * to.rotation;
        world.poses.push(to);
    }
    world
}

/// The corners of a world whose board is said to be larger by a share.
fn said_larger(world: &World, seed: u64, share: f64) -> Corners {
    let Board { squares, square_mm, .. } = world.board;
    Corners { board: Board::checker(squares, square_mm * (1.0 + share)), ..world.corners(seed) }
}

fn calibrated(corners: &Corners) -> Calibration {
    calibrate(corners, &Options { lens: Some(crate::stereo::Lens::Brown4), ..Options::default() }).unwrap()
}

fn stated(moves: &[&str]) -> Vec<StatedMove> {
    moves.iter().map(|text| text.parse().unwrap()).collect()
}

fn measured(corners: &Corners, moves: &[&str]) -> KnownMoves {
    measure(&calibrated(corners), &stated(moves)).unwrap()
}

fn judged(corners: &Corners, moves: &[&str], tolerance_mm: f64) -> (Judged, Verdict, Option<Finding>) {
    let found = calibrated(corners);
    let standards = Standards { second: None, moves: measure(&found, &stated(moves)).unwrap() };
    let judged = synthetic::judged(&found, Vec::new(), standards, tolerance_mm);
    let line = judged.evidence.iter().filter(|line| line.what == "known move").map(|line| line.allows);
    let (allows, finding) = (line.fold(Verdict::Pass, Verdict::and), judged.of_scale());
    (judged, allows, finding)
}

#[test]
fn moves_that_are_as_stated_agree_and_scatter_as_they_say() {
    const SEEDS: u64 = 25;
    let (mut contradict, mut turned, mut squares) = (0, 0, 0.0);
    for seed in 0..SEEDS {
        // The block is as far off as it is stated.
        let off_mm = 0.5 * UNCERTAINTY_MM * Draws::new(seed, Purpose::Points, 5).normal();
        let found = measured(&slid(seed, &[(5.0 + off_mm, 0.0)]).corners(seed), &["5mm"]);
        let [known] = &found.measured[..] else { panic!("{found:?}") };
        assert_eq!(known.pairs, ["11", "12"]);
        contradict += usize::from(known.contradicts());
        turned += usize::from(known.turned);
        squares += ((known.measured_mm - 5.0 - off_mm) / known.measured_sigma_mm).powi(2);
    }
    let scatter = (squares / SEEDS as f64).sqrt();
    // At most one in a hundred of either: of 600 seeds none contradict and 6 are said to have turned.
    assert!(contradict <= 2 && turned <= 2, "{contradict} contradict, {turned} turned of {SEEDS}");
    // So many draws know a standard deviation to 14 %.
    assert!((0.7..1.3).contains(&scatter), "{scatter}");
}

#[test]
fn a_scale_that_is_wrong_is_seen_from_the_stated_size_on_with_its_size() {
    for percent in [0.1, 0.3, 1.0] {
        let mut seen = 0;
        for seed in 0..3 {
            let corners = said_larger(&slid(seed, &[(5.0, 0.0)]), seed, percent / 100.0);
            let (judged, allows, finding) = judged(&corners, &["5mm+-0.002:11,12"], 0.05);
            let known = &judged.facts.standards.moves.measured[0];
            assert!((known.scale_error - percent / 100.0).abs() < 1.5 * known.expanded(), "{}", known.statement());
            assert_ne!(allows, Verdict::Pass, "{percent} {seed}: {}", known.statement());
            assert!(allows == Verdict::Fail || percent < 0.2, "{percent} {seed}: {}", known.statement());
            seen += usize::from(known.contradicts());
            assert_eq!(finding.is_some(), known.contradicts());
            if let Some(finding) = finding {
                assert_eq!(finding.cause, "other-board|known-move");
                assert!((known.square_mm / 15.0 - 1.0).abs() < 1.5 * known.expanded(), "{known:?}");
            }
        }
        // Six in seven errors as large as the smallest are seen, more than nineteen in twenty of the others.
        assert!(seen >= if percent < 0.2 { 2 } else { 3 }, "{percent} %: {seen} of 3");
    }
}

#[test]
fn a_move_that_is_stated_wrong_is_seen_and_others_tell_it_from_the_scale() {
    for (off_mm, percent) in [(0.01, 0.0), (0.05, 0.0), (0.2, 0.0), (0.0, 0.5)] {
        for seed in 20..22 {
            let world = slid(seed, &[(5.0 - off_mm, 0.0), (20.0 - off_mm, 0.0)]);
            let corners = said_larger(&world, seed, percent / 100.0);
            let one = measured(&corners, &["5mm:11,12"]);
            assert_eq!(one.causes(), [Cause::OtherBoard, Cause::KnownMove], "{}", one.measured[0].statement());
            let both = measured(&corners, &["5mm:11,12", "20mm:12,13"]);
            let cause = if percent > 0.0 { Cause::OtherBoard } else { Cause::KnownMove };
            assert_eq!(both.causes(), [cause], "{off_mm} mm, {percent} %: {}", both.measured[1].statement());
            assert!(both.why().unwrap().contains("all moves show one scale") == (percent > 0.0));
        }
    }
}

#[test]
fn a_move_that_agrees_and_tells_less_takes_nothing_from_one_that_tells_enough() {
    for seed in [50, 51] {
        let corners = slid(seed, &[(5.0, 0.0), (20.0, 0.0)]).corners(seed);
        let tells_mm = |stated: &str| {
            let (judged, ..) = judged(&corners, &[stated], 1.0);
            judged.evidence.iter().find(|line| line.what == "known move").and_then(|line| line.value).unwrap()
        };
        let [short, long] = ["5mm:11,12", "20mm:12,13"];
        let tolerance_mm = 0.5 * (tells_mm(short) + tells_mm(long));
        assert_eq!(judged(&corners, &[short], tolerance_mm).1, Verdict::Undecided);
        assert_eq!(judged(&corners, &[short, long], tolerance_mm).1, Verdict::Pass);
        // One that is wrong is not covered by it.
        let wrong = judged(&corners, &["5.1mm:11,12", long], tolerance_mm).1;
        assert_ne!(wrong, Verdict::Pass);
    }
}

#[test]
fn a_board_that_turned_is_said_with_its_turn_and_is_no_proof() {
    for deg in [0.05, 0.5] {
        for seed in 30..32 {
            let corners = slid(seed, &[(5.0, deg)]).corners(seed);
            let (judged, allows, finding) = judged(&corners, &["5mm:11,12"], 0.05);
            let known = &judged.facts.standards.moves.measured[0];
            assert!(known.turned && (known.turn_deg - deg).abs() < 0.02, "{}", known.statement());
            assert!(known.statement().contains("it must only slide"));
            assert!(!known.contradicts() && finding.is_none(), "{}", known.statement());
            assert_eq!(allows, Verdict::Undecided);
        }
    }
}

#[test]
fn which_pairs_are_meant_is_told_by_their_look_or_asked_for() {
    let found = calibrated(&slid(40, &[(5.0, 0.0), (0.0, 3.0), (5.0, 0.5)]).corners(40));
    let ends = |text: &str| measure(&found, &stated(&[text])).map(|moves| moves.measured[0].pairs.clone());
    assert_eq!(ends("5mm").unwrap(), ["11", "12"]);
    assert_eq!(ends("5.1mm").unwrap(), ["11", "12"]);
    assert_eq!(ends("5mm:13,14").unwrap(), ["13", "14"]);
    for far in ["6mm", "50mm"] {
        let said = ends(far).unwrap_err();
        assert!(matches!(said, Error::MoveUnsettled { fits: 0, .. }), "{said}");
    }
    let said = ends("6mm").unwrap_err().to_string();
    assert!(said.contains("\n  11,12: moved by 5.0"), "{said}");
    let again = calibrated(&slid(41, &[(5.0, 0.0), (5.0, 0.0)]).corners(41));
    let said = measure(&again, &stated(&["5mm"])).unwrap_err();
    assert!(matches!(said, Error::MoveUnsettled { fits: 2, .. }), "{said}");
    assert!(said.to_string().contains("11,12") && said.to_string().contains("12,13"), "{said}");
    assert!(matches!(ends("5mm:11,99"), Err(Error::NoSuchPair { pair, .. }) if pair == "99"));
    let twice = measure(&found, &stated(&["5mm", "5mm:12,11"])).unwrap_err();
    assert!(matches!(twice, Error::MoveTwice { .. }), "{twice}");
}

#[test]
fn a_pair_that_was_not_used_is_no_proof_and_named() {
    let mut corners = slid(42, &[(5.0, 0.0)]).corners(42);
    let same = corners.pairs[12].clone();
    corners.pairs.push(crate::imaging::PairCorners { pair: "13".to_owned(), ..same });
    let (judged, allows, _) = judged(&corners, &["5mm:11,13"], 0.05);
    assert_eq!(allows, Verdict::Undecided);
    let said = &judged.facts.standards.moves.missing[0];
    assert!(said.contains("pair 13 is not used, the same pictures as pair 12"), "{said}");
}

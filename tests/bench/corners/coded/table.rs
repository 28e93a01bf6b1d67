//! What came of the pictures, by what they show: dictionary, share of the board, tilt, blur, noise, size of squares.

use stereocal::imaging::board::Kind;

use super::bound::margin;
use super::case::Case;
use super::{Found, Outcome};

/// What pictures are told apart by: its title, and a picture's group.
type Group<'a> = (&'a str, &'a dyn Fn(&Case) -> String);

/// Prints a line a group, the wrong numbers, and the boards that were not found although twelve corners are in view.
pub fn print(outcomes: &[Outcome]) {
    println!("                      of 12 or more | margin of 3 blurs and 2 px:  over | less:");
    println!(
        "               pictures  found   corners  wrong | corners   chi2  bound   rms px | corners   chi2   rms px"
    );
    let groups: [Group; 7] = [
        ("dictionary", &family),
        ("margin", &|case| format!("{:.2}", margin(case))),
        ("share seen", &|case| between(case.share_seen(), &[0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0])),
        ("tilt, deg", &|case| between(case.tilt_deg, &[0.0, 15.0, 30.0, 45.0, 60.0])),
        ("blur, px", &|case| between(case.blur_px, &[0.5, 1.0, 1.5, 2.0, 2.5])),
        ("noise", &|case| between(case.noise, &[0.5, 1.5, 3.0, 5.0])),
        ("square, px", &|case| between(case.square_px(), &[0.0, 18.0, 27.0, 40.0, 60.0, 100.0])),
    ];
    for (title, group) in groups {
        println!("{title}");
        let mut names: Vec<String> = outcomes.iter().map(|outcome| group(&outcome.case)).collect();
        names.sort();
        names.dedup();
        for name in names {
            line(&name, &outcomes.iter().filter(|outcome| group(&outcome.case) == name).collect::<Vec<_>>());
        }
    }
    line("all", &outcomes.iter().collect::<Vec<_>>());
    for outcome in outcomes.iter().filter(|o| o.corners.iter().any(|c| c.is_wrong)).take(20) {
        let wrong = outcome.corners.iter().filter(|c| c.is_wrong).count();
        println!(
            "   picture {}: {} has {wrong} wrong numbers of {}",
            outcome.name,
            outcome.case.board,
            outcome.corners.len()
        );
    }
    for outcome in outcomes.iter().filter(|o| o.reason.is_some() && o.visible >= FEW) {
        let reason = outcome.reason.as_deref().unwrap_or_default();
        let Case { board, tilt_deg, blur_px, .. } = &outcome.case;
        println!(
            "   picture {}: {board}, squares of {:.0} px, tilt {tilt_deg:.0}, blur {blur_px:.1} px, {} corners in view: {reason}",
            outcome.name,
            outcome.case.square_px(),
            outcome.visible
        );
    }
}

/// Boards of which fewer corners are in view need not be found.
const FEW: usize = 12;

fn family(case: &Case) -> String {
    let (Kind::Charuco { dictionary, .. } | Kind::Tags { family: dictionary, .. }) = case.board.kind else {
        panic!("a board with markers")
    };
    dictionary.name().replace("DICT_", "").split('_').take(2).collect::<Vec<_>>().join("_")
}

/// The step from one of these limits to the next that holds a value.
fn between(value: f64, limits: &[f64]) -> String {
    let step = limits.windows(2).find(|step| value <= step[1]).unwrap_or(&limits[limits.len() - 2..]);
    format!("{:4} to {:4}", step[0], step[1])
}

fn line(name: &str, outcomes: &[&Outcome]) {
    let corners: Vec<&Found> = outcomes.iter().flat_map(|o| &o.corners).collect();
    let in_view: Vec<&&Outcome> = outcomes.iter().filter(|o| o.visible >= FEW).collect();
    let found = in_view.iter().filter(|o| o.reason.is_none()).count();
    let wrong = corners.iter().filter(|c| c.is_wrong).count();
    let of = |has_margin: bool| {
        let of: Vec<&&Found> = corners.iter().filter(|c| c.has_margin == has_margin && !c.is_wrong).collect();
        let mean = |value: &dyn Fn(&Found) -> Option<f64>| {
            let known: Vec<f64> = of.iter().filter_map(|c| value(c)).collect();
            known.iter().sum::<f64>() / known.len() as f64
        };
        let over = mean(&|c| c.of_bound).sqrt();
        (of.len(), mean(&|c| Some(c.chi2)), over, mean(&|c| Some(c.off_px * c.off_px / 2.0)).sqrt())
    };
    let ((yes, chi2, over, rms), (no, other_chi2, _, other_rms)) = (of(true), of(false));
    println!(
        "{name:15} {:7} {found:6} {:9} {wrong:6} | {yes:7} {chi2:6.3} {over:6.3} {rms:8.4} | {no:7} {other_chi2:6.3} {other_rms:8.4}",
        in_view.len(),
        corners.len()
    );
}

//! The figures of `identify.html`.

use maud::{Markup, html};
use nalgebra::Point3;

use crate::identify::judge::errors::RowError;
use crate::identify::judge::uncertainty::Expected;
use crate::identify::record::Record;
use crate::identify::solve::swarm::halton;
use crate::measurements::Role;
use crate::report::drawing::figure::Plot;
use crate::report::drawing::scene::{Ink, Scene};
use crate::report::{Result, page};

/// The errors of rows that took no part in the fit; `folded` where each was left out of a fit of its own.
pub(super) fn verification_figure(before: &[RowError], after: &[RowError], folded: bool) -> Result<Markup> {
    let numbered = |(i, e): (usize, &RowError)| Some(((i + 1) as f64, e.distance_mm?.abs()));
    let series = |errors: &[RowError]| -> Vec<(f64, f64)> {
        errors.iter().enumerate().filter_map(numbered).filter(|(_, error)| *error > 0.0).collect()
    };
    let (title, rows) = match folded {
        true => ("Distance errors of rows held out of the fit", "row, in the order of the file"),
        false => ("Distance errors of the verify rows", "verify row, in the order of the file"),
    };
    let svg = Plot::new(title, rows, "absolute error, mm")
        .whole_x()
        .points("before", series(before))
        .points("after", series(after))
        .log_y()
        .svg()?;
    Ok(page::figure(
        &svg,
        "Each distance before and after identification; the scale is logarithmic. A pose that is \
         as far off after as before is one that the model cannot explain: see the table of the worst.",
    ))
}

/// The poses by thirds of the error to expect, from above and from the side.
pub(super) fn expected_map(expected: &Expected, places: &[(Role, Point3<f64>)]) -> Result<Markup> {
    let least_mm = expected.map.iter().map(|(_, mm)| *mm).fold(f64::INFINITY, f64::min);
    let view = |title: &str, vertical: &str, axes: (usize, usize)| {
        let points = expected.map.iter().zip(places).map(|((_, mm), (_, p))| (p[axes.0], p[axes.1], *mm));
        Plot::new(title, "x, mm", vertical).equal_axes().points_by_thirds(&points.collect::<Vec<_>>(), least_mm).svg()
    };
    let caption = "The error to expect at the poses of the file, base frame, a third of them each. More poses help most where it is largest.";
    Ok(html! { div.side {
        (page::figure(&view("Error to expect, from above", "y, mm", (0, 1))?, caption))
        (page::figure(&view("Error to expect, from the side", "z, mm", (0, 2))?, "The same from the side."))
    } })
}

pub(super) fn convergence_figure(record: &Record) -> Result<Markup> {
    let model = record.chosen_method().map_or("", |m| m.model);
    let mut plot = Plot::new("Best cost by iteration", "iteration", "cost, mm²").log_y();
    for method in record.methods.iter().filter(|m| m.model == model) {
        let history = method.history.iter().enumerate().filter(|(_, c)| **c > 0.0);
        plot = plot.line(method.name, history.map(|(i, &c)| (i as f64, c)));
    }
    Ok(page::figure(&plot.svg()?, "Lines that end above the lowest one have stopped short of the minimum."))
}

/// The arm and the points at which it was measured.
pub(super) fn in_space(places: &[(Role, Point3<f64>)], arm: &[Point3<f64>]) -> Markup {
    let mut scene = Scene::default();
    scene.line(Ink::Frame, arm.to_vec());
    for &(role, at) in places {
        let ink = match role {
            Role::Sample => Ink::Plain,
            Role::Verify => Ink::Bad,
            Role::Center => Ink::Good,
        };
        scene.line(ink, vec![at]);
    }
    scene.word(Point3::origin(), "base");
    let caption = "The arm at the first centre pose and the points of the target in the base frame: samples in blue, rows to verify in red, centres in green. The identified robot holds where these points are.";
    scene.upright().figure("the arm and where it was measured", caption)
}

/// Fig. 7 of the paper: the poses from above and from the side.
pub(super) fn layout_figures(places: &[(Role, Point3<f64>)]) -> Result<Markup> {
    let view = |title: &str, vertical: &str, axes: (usize, usize)| {
        let series = |role: Role| places.iter().filter(move |(r, _)| *r == role).map(|(_, p)| (p[axes.0], p[axes.1]));
        Plot::new(title, "x, mm", vertical)
            .points("sample", series(Role::Sample))
            .points("verify", series(Role::Verify))
            .points("centre", series(Role::Center))
            .equal_axes()
            .svg()
    };
    let caption = "Where the nominal robot puts the target, base frame. What lies outside of these points was not \
                   identified, and the corrections hold there only as far as the model is right.";
    Ok(html! { div.side {
        (page::figure(&view("Poses from above", "y, mm", (0, 1))?, caption))
        (page::figure(&view("Poses from the side", "z, mm", (0, 2))?, "The same poses from the side: the heights and reaches over which the identification holds."))
    } })
}

/// Points of each start in Fig. 3.
const START_POINTS: usize = 200;

/// Fig. 3 of the paper: Halton's sequence beside pseudo-random numbers.
pub(super) fn start_figures(seed: u64) -> Result<Markup> {
    let plot = |title: &str, numbers: &[f64]| {
        let pairs = numbers.chunks_exact(2).map(|p| (p[0], p[1]));
        Plot::new(title, "first coordinate", "second coordinate").points("", pairs).equal_axes().svg()
    };
    let halton = plot("Halton sequence", &halton::points(START_POINTS, 2, seed))?;
    let random = plot("Pseudo-random numbers", &crate::identify::solve::swarm::uniform(2 * START_POINTS, seed))?;
    Ok(html! { div.side {
        (page::figure(&halton, "Halton's points, where STAPSO starts, leave neither clusters nor holes."))
        (page::figure(&random, "Pseudo-random points, where the other swarms start, have both."))
    } })
}

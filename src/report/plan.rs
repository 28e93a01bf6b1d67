//! A plan for people: what it determines, the accuracy to expect, what the cameras will see.

use maud::html;
use nalgebra::{Point3, Vector3};

use super::drawing::figure::Plot;
use super::table::{Table, number, short};
use super::{Result, page};
use crate::diagnostic::{capital, count, two_digits};
use crate::formats::plan::{Determined, Expected, PlanFile};
use crate::measurements::Role;
use crate::plan::predict::Accuracy;
use crate::plan::scene::{Placement, Scene};
use crate::plan::{COLLISIONS, Plan};
use crate::robot::Robot;

/// The figures on the terminal.
pub fn summary(record: &PlanFile) -> String {
    let columns = ["samples", "this plan, mm", "the paper's, mm"];
    let columns = columns.into_iter().take(if record.paper.is_some() { 3 } else { 2 });
    let mut table = Table::new(columns);
    for expected in &record.plan.expected {
        let same = |e: &&Expected| e.poses == expected.poses;
        let of = |e: &Expected| number(Some(e.rms_mm), 4);
        let paper = record.paper.iter().map(|paper| paper.expected.iter().find(same).map_or_else(String::new, of));
        table.row([expected.poses.to_string(), of(expected)].into_iter().chain(paper));
    }
    let of = |d: &Determined| {
        let o = d.accuracy.observability.as_ref();
        format!(
            "{} of {} parameters determined (rank), condition {}, observability O1 {}, O2 {}, O3 {}, O4 {}, O5 {}",
            d.accuracy.rank,
            d.accuracy.parameters,
            number(d.accuracy.condition, 0),
            number(o.map(|o| o.o1), 2),
            number(o.map(|o| o.o2), 5),
            number(o.map(|o| o.o3), 3),
            number(o.map(|o| o.o4), 5),
            number(o.map(|o| o.o5), 3)
        )
    };
    let mut text = format!("this plan:   {}\n", of(&record.plan));
    match &record.paper {
        Some(paper) => text += &format!("the paper's: {}\n", of(paper)),
        None => text += "the paper's plan is left out: this robot does not reach its poses before these cameras\n",
    }
    undetermined(&record.plan.accuracy).iter().for_each(|said| text += &format!("{said}\n"));
    text += &format!(
        "error of the target over the spheres through the parameters alone (root mean square, {:.4} mm noise a coordinate); what `identify` expects \
         holds the robot's own scatter and the rig's own error, too:\n{table}",
        record.noise_mm
    );
    text
}

/// The parameters that are not determined, as many as the rank lacks.
fn undetermined(Accuracy { parameters, rank, zero, dependent, .. }: &Accuracy) -> Vec<String> {
    let none = (!zero.is_empty()).then(|| format!("not determined: {}", zero.join(", ")));
    let others = parameters - rank - zero.len();
    let sums = (others > 0).then(|| format!("{others} only in sums: {}", dependent.join("; ")));
    none.into_iter().chain(sums).collect()
}

pub fn page(scene: &Scene, robot: &Robot, plan: &Plan, record: &PlanFile) -> Result<String> {
    let rows = record.plan.expected.iter().map(|e| [e.poses.to_string(), two_digits(e.rms_mm)]);
    let others: Vec<String> = record.warnings.iter().filter(|warning| *warning != COLLISIONS).cloned().collect();
    let accuracy = &record.plan.accuracy;
    let content = html! {
        (page::verdict(page::Tone::Doubtful, "Collisions are not checked", &numbers(record, plan),
            "Neither the arm with itself, nor with the cameras or the cell. Run the program slowly, hand on the stop."))
        (page::warnings(&others))
        h2 { "Accuracy to expect" }
        (page::table(&["samples", "error, mm"], rows))
        p { "Root mean square of the target's position error that the identified parameters will leave over the spheres, tilts to 25 degrees, after one rigid fit; "
            (two_digits(record.noise_mm)) " mm noise a coordinate. The robot's own scatter (repeatability, and what the model lacks) comes on top: what "
            code { "identify" } " expects holds both, and its page tells them apart. Rank " (accuracy.rank) " of " (accuracy.parameters) ", condition " (number(accuracy.condition, 0)) "." }
        @for said in undetermined(accuracy) { p { (capital(&said)) "." } }
        (curve(record)?)
        (map(plan)?)
        h2 { "Where the cameras stand" }
        p { "One placement a group. Place the left camera so, base frame; a tenth of a metre and ten degrees off are taken up by " code { "plan --after" } " a few first poses." }
        (page::table(
            &["group", "left camera x, mm", "y, mm", "z, mm", "looks along x", "y", "z", "middle of the sphere x, mm", "y, mm", "z, mm"],
            plan.placements.iter().map(standing),
        ))
        h2 { "Where the target goes, and the cameras stand" }
        div.side { @for figure in sides(robot, plan)? { (figure) } }
        h2 { "What the cameras will see" }
        div.side { @for figure in pictures(scene, plan)? { (figure) } }
    };
    let lead = format!(
        "{} poses in {}, chosen from {} candidates",
        plan.poses.len(),
        count(plan.placements.len(), "group"),
        plan.pool
    );
    Ok(page::page("Planned poses", &lead, &content))
}

/// The three numbers of a plan.
fn numbers(record: &PlanFile, plan: &Plan) -> [(String, String); 3] {
    let samples = plan.poses.iter().filter(|p| p.at.role == Role::Sample).count();
    let best = record.plan.expected.iter().filter(|e| e.poses <= samples).max_by_key(|e| e.poses);
    [
        (
            format!("{} mm", short(best.map(|e| e.rms_mm))),
            format!("position error that the parameters leave after {} samples", best.map_or(samples, |e| e.poses)),
        ),
        (plan.poses.len().to_string(), format!("poses, {samples} of them samples")),
        (record.plan.accuracy.rank.to_string(), "parameters determined".to_owned()),
    ]
}

/// A placement as somebody would set it up: where the left camera is, where it looks, and what it looks at.
fn standing(placement: &Placement) -> impl Iterator<Item = String> + use<> {
    let base_from_left = placement.left_from_base.inverse();
    let along = base_from_left.rotation * Vector3::z();
    let lengths = |v: Vector3<f64>| [v.x, v.y, v.z].map(|c| format!("{:.0}", c + 0.0));
    let direction = [along.x, along.y, along.z].map(|c| format!("{:.3}", c + 0.0));
    let cells = [lengths(base_from_left.translation.vector), direction, lengths(placement.center_mm)];
    std::iter::once(placement.name.clone()).chain(cells.into_iter().flatten())
}

fn curve(record: &PlanFile) -> Result<maud::Markup> {
    let line = |d: &Determined| -> Vec<_> { d.expected.iter().map(|e| (e.poses as f64, e.rms_mm)).collect() };
    let mut plot = Plot::new("Error by the number of poses", "samples", "error by the parameters, mm").log_y();
    plot = plot.line("this plan", line(&record.plan));
    if let Some(paper) = &record.paper {
        plot = plot.line("as planned by Shi et al.", line(paper));
    }
    let of_paper = match record.paper {
        Some(_) => " Shi et al. visit points on the same spheres with one orientation of the flange.",
        // The first few poses are planned without a comparison.
        None if record.plan.expected.is_empty() => "",
        None => " This robot does not reach the poses of Shi et al. before these cameras.",
    };
    let caption = format!(
        "Where the line is flat, more poses do not help: the rest comes from what the plan does not vary, not from noise.{of_paper}"
    );
    Ok(page::figure(&plot.svg()?, &caption))
}

/// Places of the spheres by thirds of the expected error.
fn map(plan: &Plan) -> Result<maud::Markup> {
    let points: Vec<(f64, f64, f64)> = plan.map.iter().map(|m| (m.0.x, m.0.y, m.1)).collect();
    let plot = Plot::new("Error over the workspace, from above", "x, mm", "y, mm").equal_axes();
    Ok(page::figure(
        &plot.points_by_thirds(&points, 0.0).svg()?,
        "The position error that the parameters will leave at new poses, base frame; a third of them each. Work where it is small, or measure more poses where it is large.",
    ))
}

/// Target points from three sides.
fn sides(robot: &Robot, plan: &Plan) -> Result<Vec<maud::Markup>> {
    let axes = ["x, mm", "y, mm", "z, mm"];
    let figure = |(title, across, up): (&str, usize, usize)| {
        let flat = |p: Vector3<f64>| (p[across], p[up]);
        let (x, y) = (axes[across], axes[up]);
        let mut plot = Plot::new(title, x, y).equal_axes().size(460, 400);
        for (role, label) in [(Role::Sample, "samples"), (Role::Verify, "verify"), (Role::Center, "centres")] {
            let of = plan.poses.iter().filter(|p| p.at.role == role);
            let points: Vec<_> = of.map(|p| flat(robot.target_mm(&p.at.joints_rad()).coords)).collect();
            if !points.is_empty() {
                plot = plot.points(label, points);
            }
        }
        let cameras: Vec<_> =
            plan.placements.iter().map(|p| flat(p.left_from_base.inverse().translation.vector)).collect();
        Ok(page::figure(
            &plot.points("left camera", cameras).svg()?,
            "The target's mark point and the left camera of each group in the base frame: what lies outside of these spheres is extrapolated.",
        ))
    };
    [("From above", 0, 1), ("From the front", 1, 2), ("From the side", 0, 2)].into_iter().map(figure).collect()
}

/// Outlines of the target's squares in both pictures.
fn pictures(scene: &Scene, plan: &Plan) -> Result<Vec<maud::Markup>> {
    let board = scene.board;
    let [w, h] = board.extent_mm().map(|mm| mm / 2.0);
    let corners = [(-w, -h), (w, -h), (w, h), (-w, h), (-w, -h)];
    let figure = |left: bool| {
        let camera = if left { scene.rig.left } else { scene.rig.right };
        let title = if left { "Left picture" } else { "Right picture" };
        let mut plot = Plot::new(title, "x, px", "y, px").equal_axes().y_down().size(460, 460);
        plot = plot.ranges((0.0, f64::from(camera.width)), (0.0, f64::from(camera.height)));
        for pose in &plan.poses {
            let project = |(x, y)| scene.rig.project(&(pose.left_from_target * Point3::new(x, y, 0.0)));
            let outline = corners.map(project).map(|(l, r)| if left { (l.x, l.y) } else { (r.x, r.y) });
            plot = plot.line("", outline);
        }
        Ok(page::figure(
            &plot.svg()?,
            "Outlines of the target at all poses, the cameras standing as in the table: it stays within both pictures.",
        ))
    };
    [true, false].into_iter().map(figure).collect()
}

//! A rig that changes along a short run, pictures that are mirrored or not simultaneous: what is said, whether that is
//! the reason, and how far the points that are given as good are off against what they say of themselves.

use nalgebra::Vector3;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::world::World;
use stereocal::stereo::board_pose::rig_change::judgement::Judgement;
use stereocal::stereo::board_pose::series::measure;
use stereocal::stereo::board_pose::{Knowledge, Seen, Series};
use stereocal::stereo::pairs::flip::Flip;

use crate::faults::{degrees, worst};
use crate::worlds::{changing_knowledge, changing_run, knowledge, world};

/// Samples besides the four centres: 14 poses.
const SAMPLES: usize = 10;
const POSES: usize = SAMPLES + 4;

/// The pose from which on a step lasts.
const STEP: usize = 6;

/// Worlds a line.
const SEEDS: u64 = 5;

/// A pose that is off by more than this many of its sigmas is given as better than it is.
const SIGMAS: f64 = 5.0;

/// `None` where the pictures do not calibrate the rig.
type Plant = fn(&World, f64) -> Option<(Knowledge, Vec<Seen>)>;

struct Line {
    what: &'static str,
    sizes: &'static [f64],
    plant: Plant,
    is_reason: fn(&Judgement, &World) -> bool,
    /// No alarm is due.
    clean: bool,
}

fn step(judgement: &Judgement, world: &World) -> bool {
    matches!(judgement, Judgement::Moved { since, creeps: false, .. } if *since == world.poses[STEP].commanded.pose)
}

fn creep(judgement: &Judgement, _: &World) -> bool {
    matches!(judgement, Judgement::Moved { creeps: true, .. })
}

/// That it creeps, or, of one so small that it costs no pose, what it is on the average of the run, among its equals.
fn focus(judgement: &Judgement, world: &World) -> bool {
    let said = judgement.describe(&world.rig, &world.target.drawing).unwrap_or_default();
    creep(judgement, world) || (matches!(judgement, Judgement::Allowed(_)) && said.contains("focal length"))
}

const LINES: [Line; 7] = [
    Line {
        what: "right camera turned at pose 7, deg",
        sizes: &[0.0005, 0.001, 0.005, 0.02, 0.1],
        plant: |w, deg| {
            let turn = |i: usize, w: &mut World| {
                if i >= STEP {
                    w.rig.right_from_left = degrees(Vector3::y(), deg) * w.rig.right_from_left;
                }
            };
            Some((knowledge(w), changing_run(w, turn)))
        },
        is_reason: step,
        clean: false,
    },
    Line {
        what: "baseline creeps, um",
        sizes: &[3.0, 10.0, 50.0, 200.0],
        plant: |w, um| {
            let longer = |i: usize, w: &mut World| {
                let t = &mut w.rig.right_from_left.translation.vector;
                *t += t.normalize() * um / 1000.0 * i as f64 / (POSES - 1) as f64;
            };
            Some((knowledge(w), changing_run(w, longer)))
        },
        is_reason: creep,
        clean: false,
    },
    Line {
        what: "yaw creeps, deg",
        sizes: &[0.001, 0.005, 0.02],
        plant: |w, deg| {
            let turn = |i: usize, w: &mut World| {
                let so_far = deg * i as f64 / (POSES - 1) as f64;
                w.rig.right_from_left = degrees(Vector3::y(), so_far) * w.rig.right_from_left;
            };
            Some((knowledge(w), changing_run(w, turn)))
        },
        is_reason: creep,
        clean: false,
    },
    Line {
        what: "right focus creeps, ppm",
        sizes: &[20.0, 100.0, 500.0],
        plant: |w, ppm| {
            let focus = |i: usize, w: &mut World| {
                let by = 1.0 + ppm * 1e-6 * i as f64 / (POSES - 1) as f64;
                (w.rig.right.fx, w.rig.right.fy) = (w.rig.right.fx * by, w.rig.right.fy * by);
            };
            Some((knowledge(w), changing_run(w, focus)))
        },
        is_reason: focus,
        clean: false,
    },
    Line {
        what: "yaw at random from pose to pose, deg",
        sizes: &[0.001, 0.005, 0.02],
        plant: |w, deg| Some((knowledge(w), changing_run(w, shaken(w, deg, 0.0, 1)))),
        is_reason: |judgement, _| matches!(judgement, Judgement::Loose { .. }),
        clean: false,
    },
    Line {
        what: "all pictures mirrored",
        sizes: &[1.0],
        plant: |w, _| {
            let known = knowledge(w);
            let mut seen = changing_run(w, |_, _| ());
            mirror(w, &mut seen);
            Some((known, seen))
        },
        is_reason: |judgement, _| matches!(judgement, Judgement::OtherWayRound(Flip::Mirrored)),
        clean: false,
    },
    Line {
        what: "held by hand, both times, mm",
        sizes: &[0.02, 0.1, 0.5],
        plant: |w, mm| {
            let deg = mm / 20.0;
            Some((changing_knowledge(w, shaken(w, deg, mm, 2))?, changing_run(w, shaken(w, deg, mm, 3))))
        },
        is_reason: |judgement, _| matches!(judgement, Judgement::Agrees),
        clean: true,
    },
];

/// `right_from_left` is turned about y and shifted at random from picture to picture, as by a board that moves between
/// the two.
fn shaken(world: &World, deg: f64, mm: f64, stream: u64) -> impl Fn(usize, &mut World) {
    let seed = world.settings.seed;
    move |i, world| {
        let mut draws = Draws::new(seed * 1000 + stream * 100 + i as u64, Purpose::Points, 11);
        let shift = Vector3::from_fn(|_, _| draws.normal() * mm);
        let rig = &mut world.rig;
        rig.right_from_left = degrees(Vector3::y(), draws.normal() * deg) * rig.right_from_left;
        rig.right_from_left.translation.vector += shift;
    }
}

/// Both pictures of every pose, left for right; their corners are numbered as they are found then.
fn mirror(world: &World, seen: &mut [Seen]) {
    let (width, columns) = (f64::from(world.rig.left.width), world.target.drawing.columns());
    for pair in seen.iter_mut().filter_map(|s| s.corners.as_mut().ok()) {
        for corners in [&mut pair.left, &mut pair.right] {
            for corner in corners.iter_mut() {
                corner.px.x = width - 1.0 - corner.px.x;
                corner.col = columns - 1 - corner.col;
            }
            corners.sort_by_key(|c| (c.row, c.col));
        }
    }
}

/// What is counted over all lines.
#[derive(Default)]
struct Counts {
    silent: usize,
    alarms: usize,
    wrong: usize,
    runs: usize,
}

pub fn run() {
    println!(
        "\nrig changes, {POSES} poses at 1280 px, {SEEDS} worlds a line: poses given as good, runs that end, the points that are given"
    );
    println!(
        "{:38} {:>7} | ok of all that calibrate, ends | worst mm, sigmas | reason right, unknown, wrong | said",
        "", "size"
    );
    let mut counts = Counts::default();
    for line in &LINES {
        for &size in line.sizes {
            one_line(line, size, &mut counts);
        }
    }
    let Counts { silent, alarms, wrong, runs } = counts;
    println!(
        "of {runs} runs: SILENT (off by more than {SIGMAS} sigmas without a word) {silent}, FALSE ALARM {alarms}, wrong reasons {wrong}"
    );
}

fn one_line(line: &Line, size: f64, counts: &mut Counts) {
    let (mut ok, mut poses, mut ends, mut mm, mut sigmas) = (0, 0, 0, 0.0_f64, 0.0_f64);
    let (mut right, mut unknown, mut wrong, mut said) = (0, 0, 0, None);
    for seed in 0..SEEDS {
        let world = world(1280, 10.0, SAMPLES, 500 + seed);
        let Some((known, seen)) = (line.plant)(&world, size) else { continue };
        (counts.runs, poses) = (counts.runs + 1, poses + POSES);
        let series: Series = measure(&known, seen);
        let off = worst(&series, &world);
        let measured = series.poses.iter().filter(|p| p.target.is_ok()).count();
        (ok, mm, sigmas) = (ok + measured, mm.max(off.1), sigmas.max(off.0));
        let judgement = &series.judgement;
        ends += usize::from(judgement.ends_the_run());
        let silent = matches!(judgement, Judgement::Agrees);
        counts.silent += usize::from(silent && off.0 > SIGMAS);
        counts.alarms += usize::from(line.clean && (!silent || measured < POSES));
        match judgement {
            _ if (line.is_reason)(judgement, &world) => right += 1,
            Judgement::Agrees | Judgement::Unexplained { .. } => unknown += 1,
            _ => wrong += 1,
        }
        said = said.or_else(|| judgement.describe(&known.rig, &known.board));
    }
    counts.wrong += wrong;
    println!(
        "{:38} {size:7} | {:3} of {} {ends} | {mm:8.4} {sigmas:5.1} | {right} {unknown} {wrong} | {}",
        line.what,
        ok,
        poses,
        said.unwrap_or_default().chars().take(260).collect::<String>()
    );
}

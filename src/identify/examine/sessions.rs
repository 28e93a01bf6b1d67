//! Sessions along the rows of a group: the sensor, the socket, the wire's anchor or the robot's base was moved, and
//! nobody wrote it down.
//!
//! In: a set of points or of distances, in the order of measurement. Out: the same set with each group cut where a new
//! placement explains the rest of its rows better, and what drifts. Distances to a centre that was measured before
//! everything moved are distances to a point that is unknown. Cuts are made one at a time at the row of greatest gain
//! (binary segmentation: Vostrikova, 1981) as long as the Bayesian information criterion (Schwarz, 1978) pays for the
//! cut's unknowns. Influence is bounded (weights of least absolute residuals), so that single gross errors make no
//! session; for points, touches and distances to a centre, whose model errors are as smooth in the order of a grid as a
//! drift is in time, the same rows sorted by each joint must not be cut as well. What moves evenly may be the zero of a
//! joint as well as the sensor: of both, and of steps of both, the likeliest is named, and with it what explains the
//! rows alike. A verify row belongs to the session of the fitted row before it in the file; before all, to the first.
//! What goes wrong: sessions shorter than [`SHORTEST`] rows, of a socket four touches, are not seen.

mod along;
mod drift;
mod placements;

use std::ops::Range;
use std::rc::Rc;

use nalgebra::DMatrix;

pub use self::along::{Along, Session};
use self::drift::{Drift, Moves};
use self::placements::GROSS;
pub use self::placements::{SHORTEST, split};
use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::shared;
use crate::identify::examine::misfit::IMPLAUSIBLE_MM;
use crate::identify::judge::recheck::zero;
use crate::identify::residuals::distances::Origin;
use crate::identify::residuals::eliminate::Block;
use crate::identify::settings::Settings;
use crate::identify::solve::linearised::{Fresh, Placement};
use crate::identify::solve::robust::{LEAST_FREEDOM, Loss};
use crate::identify::solve::task::Task;
use crate::linear_algebra::pseudo_inverse;
use crate::robot::Robot;

/// Of touches of a socket.
const SHORTEST_TOUCH: usize = 4;

/// A cut of points must explain this share of what is left, and this many times what a cut along any joint explains.
const SHARE: f64 = 0.1;
const BEATS: f64 = 1.3;

/// Most cuts; data that want more are no sessions.
const MOST_CUTS: usize = 30;

/// Cuts the groups of `set` into sessions.
pub fn find(set: &Dataset, robot: &Robot, settings: &Settings) -> (Dataset, Along) {
    let mut cut = set.clone();
    let mut along = Along::default();
    let parameters = robot.mdh_parameters();
    // A zero that is off is no step, and what the calibration leaves open no drift.
    let extras = shared::unknowns(set, settings);
    let (mut look, mut gross) = (Look::Uncapped, Vec::new());
    let mut drifts: Vec<Drift> = Vec::new();
    for round in 0..MOST_CUTS {
        let rows: Vec<usize> = cut.fit_rows().into_iter().filter(|row| !gross.contains(row)).collect();
        let task = Task { extras: &extras, ..Task::plain(&cut, robot, &parameters, &rows, settings) };
        let Some(search) = Search::new(&task, look) else { break };
        // A step that is not linear is looked for where links that are fitted leave more than any robot.
        let of_step = (round == 0 && search.left_mm >= IMPLAUSIBLE_MM).then_some(search.left_mm);
        if let Some(parted) = of_step.and_then(|left_mm| placements::parted(set, robot, settings, left_mm)) {
            cut = parted;
            continue;
        }
        let found = search.best_cut(&along.drifting);
        for drift in search.drifts(found) {
            if !along.drifting.contains(&drift.group) {
                along.drifting.push(drift.group.clone());
                drifts.push(drift);
            }
        }
        look = match (found, look) {
            (Some(row), _) => {
                split(&mut cut, row);
                look
            }
            (None, Look::Uncapped) if search.is_doubtful => Look::Capped,
            (None, Look::Capped) => {
                gross = gross_errors(&task);
                if gross.is_empty() {
                    break;
                }
                Look::WithoutGross
            }
            _ => break,
        };
    }
    if cut.groups.len() > set.groups.len() {
        along.sessions = along::list(&cut);
        if !drifts.is_empty() {
            let rows: Vec<usize> = set.fit_rows().into_iter().filter(|row| !gross.contains(row)).collect();
            let task = Task { extras: &extras, ..Task::plain(set, robot, &parameters, &rows, settings) };
            without_steps(&mut drifts, &task, &cut);
            along.drifting.retain(|group| drifts.iter().any(|drift| drift.group == *group));
        }
    }
    along.instead = drift::of_joints(&drifts, robot, set.groups.len() > 1);
    along.step = drift::step(&drifts);
    (cut, along)
}

/// Leaves out those of groups of which placements that begin where they are cut explain clearly more than what moves
/// evenly does; `whole` is the task of the rows before any cut.
fn without_steps(drifts: &mut Vec<Drift>, whole: &Task, cut: &Dataset) {
    let Some(search) = Search::new(whole, Look::Uncapped) else { return };
    let steps = |placed: &Placed| search.steps(placed, cut) > search.evenly(placed) + TOLD_APART;
    let of_steps: Vec<&String> = search.placed.iter().filter(|p| steps(p)).map(|p| search.name(p)).collect();
    drifts.retain(|drift| !of_steps.contains(&&drift.group));
}

/// How a search looks at rows that are far off. Gross errors hide small steps, but rows are far off beside a large step
/// as well: only where nothing is found any more are they held down, and at last left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    Uncapped,
    Capped,
    WithoutGross,
}

/// Rows that are gross errors with the sessions as they are.
fn gross_errors(task: &Task) -> Vec<usize> {
    let sigmas = task.settings.outlier_sigmas;
    match task.robust(Loss::Biweight) {
        Ok(mut robust) if sigmas > 0.0 => robust.gross_errors(sigmas),
        _ => Vec::new(),
    }
}

/// One placement as the search sees it.
struct Placed {
    /// Rows of the data set in their order, each with where its residuals start and end.
    rows: Vec<(usize, Range<usize>)>,
    /// A column an unknown of a new placement, where only some rows belong to it.
    fresh: Fresh,
    /// The same of the zero of each joint: one column.
    zeros: Vec<Fresh>,
    /// Row of the centre that was measured, from which on things move.
    center: Option<usize>,
    /// Fewest rows of a session.
    shortest: usize,
    /// Whether a new placement must explain more than what is smooth along a joint.
    rivalled: bool,
    /// The sum of squares of which it must then explain a share.
    squares: f64,
}

struct Search<'a> {
    set: &'a Dataset,
    placed: Vec<Placed>,
    /// Whether a row is so far off that it may be a gross error.
    is_doubtful: bool,
    /// Scatter of a coordinate that the fit left, mm.
    left_mm: f64,
    /// Numbers measured, how many of them the fit left, and the sum of their squares.
    numbers: f64,
    freedom: f64,
    squares: f64,
}

impl<'a> Search<'a> {
    fn new(task: &Task<'a>, look: Look) -> Option<Search<'a>> {
        let robust = task.robust(Loss::Absolute).ok()?.capped(if look == Look::Capped { GROSS } else { f64::INFINITY });
        let sigmas = task.settings.outlier_sigmas;
        let is_doubtful = sigmas > 0.0 && task.rows.iter().any(|&row| robust.scores[row] > sigmas);
        let left_mm = robust.scatter.point_mm;
        let (rows, problem, prior) = robust.linearised();
        let parts: Vec<(&Block, &Placement, DMatrix<f64>)> = rows
            .blocks
            .iter()
            .zip(&problem.placements)
            .map(|(block, placement)| (block, placement, placement.eliminated().normal))
            .collect();
        let normal = parts.iter().fold(prior, |sum, (.., own)| sum + own);
        let numbers: usize = parts.iter().map(|(b, ..)| b.row_count()).sum();
        // What is left of chance after the fit: the share that the unknowns took explains nothing any more.
        let unknowns = problem.shared + parts.iter().map(|(_, p, _)| p.linear.design.ncols()).sum::<usize>();
        let freedom = numbers.saturating_sub(unknowns).max(numbers.div_ceil(LEAST_FREEDOM));
        let squares: f64 = parts.iter().map(|(_, p, _)| p.linear.residuals.norm_squared()).sum();
        let mut placed = Vec::new();
        let at = |joint: usize| task.parameters.iter().position(|p| *p == zero(task.robot)(joint));
        let zeros: Vec<usize> = (0..task.robot.joints.len()).map_while(at).collect();
        for (block, placement, own) in parts {
            let of_rows: Vec<_> = placement.by_pose().map(|(pose, at)| (rows.rows[pose], at)).collect();
            let (linear, inverse) =
                (&placement.linear, Rc::new(pseudo_inverse(placement.with_others(&(&normal - own)))));
            let fresh = |columns| Fresh { linear: linear.clone(), columns, inverse: inverse.clone() };
            let place = |rows, columns, center, rivalled| {
                let (fresh, zeros) = (fresh(columns), Vec::new());
                Placed { rows, fresh, zeros, center, shortest: SHORTEST, rivalled, squares }
            };
            let zeros = || zeros.iter().map(|&k| fresh(linear.jacobian.columns(k, 1).into_owned())).collect();
            match block {
                Block::Points(_) => {
                    placed.push(Placed { zeros: zeros(), ..place(of_rows, linear.design.clone(), None, true) });
                }
                Block::Distances(distances) => placed.push(match distances.from {
                    Origin::Anchor(..) => place(of_rows, linear.design.clone(), None, false),
                    Origin::Center(center) => {
                        let columns = distances.of_origin(&problem.places, &rows.scatter);
                        place(of_rows, columns, Some(rows.rows[center]), true)
                    }
                }),
                // Each socket by itself: it touches few of the rows.
                Block::Touch(touch) => {
                    for socket in 0..touch.sockets.len() {
                        let contacts = of_rows.iter().zip(&touch.contacts).filter(|(_, c)| c.socket == socket);
                        let rows: Vec<_> = contacts.map(|(row, _)| row.clone()).collect();
                        let of_row =
                            |(_, at): &(usize, Range<usize>)| linear.residuals.rows(at.start, at.len()).norm_squared();
                        let squares = rows.iter().map(of_row).sum();
                        let fresh = linear.design.columns(3 * socket, 3).into_owned();
                        placed.push(Placed { shortest: SHORTEST_TOUCH, squares, ..place(rows, fresh, None, true) });
                    }
                }
                Block::Pairwise(_) => {}
            }
        }
        let (numbers, freedom) = (numbers as f64, freedom as f64);
        Some(Search { set: task.set, placed, is_doubtful, left_mm, numbers, freedom, squares })
    }

    fn pays(&self, gain: f64, unknowns: usize) -> bool {
        self.likelihood(gain, unknowns + 1) > 0.0
    }

    /// Logarithm of the likelihood that a gain of squares brings, less what so many unknowns cost (Schwarz).
    fn likelihood(&self, gain: f64, unknowns: usize) -> f64 {
        let left = (self.squares - gain).max(f64::MIN_POSITIVE);
        0.5 * (self.freedom * (self.squares / left).ln() - unknowns as f64 * self.numbers.ln())
    }

    /// The row at which a new session pays most, if any does. In groups known to drift it need not beat joints' cuts.
    fn best_cut(&self, drifting: &[String]) -> Option<usize> {
        let mut best: Option<(f64, usize, &Placed)> = None;
        for placed in &self.placed {
            let order: Vec<usize> = (0..placed.rows.len()).collect();
            if let Some((gain, k)) = placed.best_step(&placed.fresh, &order)
                && best.is_none_or(|(g, ..)| gain > g)
            {
                best = Some((gain, placed.rows[k].0, placed));
            }
        }
        let (gain, row, placed) = best?;
        if !self.pays(gain, placed.fresh.columns.ncols()) {
            return None;
        }
        if placed.rivalled {
            let gain_along = |order: &Vec<usize>| Some(placed.best_step(&placed.fresh, order)?.0);
            let rival = self.orders(placed).iter().filter_map(gain_along).fold(0.0, f64::max);
            let drifts = drifting.contains(self.name(placed));
            if gain < SHARE * placed.squares || (gain < BEATS * rival && !drifts) {
                return None;
            }
        }
        Some(row)
    }

    /// The rows of a placement sorted by each joint.
    fn orders(&self, placed: &Placed) -> Vec<Vec<usize>> {
        let sorted = |j: usize| {
            let mut order: Vec<usize> = (0..placed.rows.len()).collect();
            let angle = |k: &usize| self.set.poses[placed.rows[*k].0].joints_rad[j];
            order.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
            order
        };
        (0..self.set.joint_count()).map(sorted).collect()
    }

    /// What moves evenly along the rows of a group; where one of them is to be cut, only if no step explains more.
    fn drifts(&self, cut: Option<usize>) -> Vec<Drift> {
        self.placed.iter().filter_map(|placed| self.drift(placed, cut)).collect()
    }

    fn drift(&self, placed: &Placed, cut: Option<usize>) -> Option<Drift> {
        let order: Vec<usize> = (0..placed.rows.len()).collect();
        let likelihood = |fresh: &Fresh, gain: f64| self.likelihood(gain, fresh.columns.ncols());
        let is_cut = cut.is_some_and(|cut| placed.rows.iter().any(|(row, _)| *row == cut));
        let step = |fresh: &Fresh| Some(likelihood(fresh, placed.best_step(fresh, &order)?.0));
        let of_steps = placed.causes().filter(|_| is_cut).filter_map(|(_, fresh)| step(fresh));
        let best_step = of_steps.fold(f64::NEG_INFINITY, f64::max);
        let orders = if is_cut { Vec::new() } else { self.orders(placed) };
        let holds = |fresh: &Fresh, gain: f64| {
            let rival = || orders.iter().map(|o| placed.ramp(fresh, o).0).fold(0.0, f64::max);
            is_cut && likelihood(fresh, gain) > best_step
                || !is_cut
                    && placed.rows.len() >= 2 * placed.shortest
                    && self.pays(gain, fresh.columns.ncols())
                    && gain > SHARE * placed.squares
                    && gain > BEATS * rival()
        };
        let ramp = |(joint, fresh): (Option<usize>, &Fresh)| {
            let (gain, amount) = placed.ramp(fresh, &order);
            (likelihood(fresh, gain), holds(fresh, gain), Moves { joint, amount, from: None })
        };
        let ramps: Vec<(f64, bool, Moves)> = placed.causes().map(ramp).collect();
        if !ramps.iter().any(|(_, holds, _)| *holds) {
            return None;
        }
        // What moves evenly is half explained by a step, and the reverse. Where the sensor steps, its rows are cut.
        let steps = placed.causes().filter(|(joint, _)| !is_cut && joint.is_some());
        let steps = steps.filter_map(|(joint, fresh)| self.step(placed, joint, fresh, &order));
        let all = ramps.into_iter().map(|(likely, _, moves)| (likely, moves)).chain(steps);
        let mut all: Vec<(f64, Moves)> = all.filter(|(_, moves)| moves.is_small(self.set)).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = all.first()?.0;
        let alike = all.into_iter().take_while(|(likely, _)| best - likely < TOLD_APART);
        Some(Drift { group: self.name(placed).clone(), causes: alike.map(|(_, cause)| cause).collect() })
    }

    /// What the zero of a joint that steps at the best row is worth. The row is an unknown more.
    fn step(&self, placed: &Placed, joint: Option<usize>, fresh: &Fresh, order: &[usize]) -> Option<(f64, Moves)> {
        let (gain, first) = placed.best_step(fresh, order)?;
        let mut products = fresh.nothing();
        order.iter().filter(|&&k| k >= first).for_each(|&k| fresh.add(&mut products, &placed.rows[k].1, 1.0));
        let from = Some(self.set.poses[placed.rows[first].0].name.clone());
        let moves = Moves { joint, amount: fresh.amounts(&products)[0], from };
        Some((self.likelihood(gain, fresh.columns.ncols() + 1), moves))
    }

    /// The likelihood of a placement, or of the zero of a joint, that moves evenly along the rows.
    fn evenly(&self, placed: &Placed) -> f64 {
        let order: Vec<usize> = (0..placed.rows.len()).collect();
        let ramps = placed.causes().map(|(_, of)| self.likelihood(placed.ramp(of, &order).0, of.columns.ncols()));
        ramps.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The same of placements that begin where the rows are cut. Each row of a cut is an unknown more.
    fn steps(&self, placed: &Placed, cut: &Dataset) -> f64 {
        let group = |k: usize| cut.poses[placed.rows[k].0].group;
        let begins = (1..placed.rows.len()).filter(|&k| group(k) != group(k - 1)).map(|k| placed.rows[k].1.start);
        let begins: Vec<usize> = begins.collect();
        let own = placed.fresh.columns.ncols();
        let columns = DMatrix::from_fn(placed.fresh.columns.nrows(), own * begins.len(), |row, column| {
            if row < begins[column / own] { 0.0 } else { placed.fresh.columns[(row, column % own)] }
        });
        let fresh = Fresh { columns, ..placed.fresh.clone() };
        let mut products = fresh.nothing();
        placed.rows.iter().for_each(|(_, at)| fresh.add(&mut products, at, 1.0));
        self.likelihood(fresh.gain(&products), (own + 1) * begins.len())
    }

    /// The group of a placement.
    fn name(&self, placed: &Placed) -> &String {
        &self.set.groups[self.set.poses[placed.rows[0].0].group].name
    }
}

impl Placed {
    /// What may move: the sensor, and the zero of each joint.
    fn causes(&self) -> impl Iterator<Item = (Option<usize>, &Fresh)> {
        std::iter::once((None, &self.fresh))
            .chain(self.zeros.iter().enumerate().map(|(joint, zero)| (Some(joint), zero)))
    }

    /// The place in `order` from which on fresh columns gain most, with what they gain.
    fn best_step(&self, fresh: &Fresh, order: &[usize]) -> Option<(f64, usize)> {
        let mut products = fresh.nothing();
        let mut best: Option<(f64, usize)> = None;
        for (late, &k) in order.iter().rev().enumerate() {
            fresh.add(&mut products, &self.rows[k].1, 1.0);
            let early = order.len() - late - 1;
            if late + 1 >= self.shortest && early >= self.shortest {
                let gain = fresh.gain(&products);
                if best.is_none_or(|(g, _)| gain > g) {
                    best = Some((gain, k));
                }
            }
        }
        best
    }

    /// What something that moves evenly along `order` gains, and by how much its first unknown then moves in all.
    fn ramp(&self, fresh: &Fresh, order: &[usize]) -> (f64, f64) {
        let mut products = fresh.nothing();
        // A placement that is unknown moves from its middle on, one whose centre was measured from there on.
        let start = self.center.map_or(0.5 * order.len() as f64, |center| {
            order.iter().filter(|&&k| self.rows[k].0 < center).count() as f64
        });
        for (i, &k) in order.iter().enumerate() {
            let t = (i as f64 - start) / order.len() as f64;
            fresh.add(&mut products, &self.rows[k].1, t);
        }
        (fresh.gain(&products), fresh.amounts(&products)[0])
    }
}

#[cfg(test)]
mod tests;

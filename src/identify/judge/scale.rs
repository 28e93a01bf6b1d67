//! A scale of the readings: whether all links come out too long, or too short, by one share, and how large a share
//! would not be seen.
//!
//! In: the fit of the chain. Out: the share, its standard deviation, and how much more probable the links are with it
//! than without. Points and distances that are all too long by one share fit a robot that is too large by it, and leave
//! no residual. What tells is the tolerance of the links alone: their errors have nothing to do with their lengths. How
//! large that tolerance is, the links' errors say themselves, with what is known of workshops where they are few; the
//! share is then a generalised least squares over what the poses determine, and the evidence (as for the tolerances:
//! MacKay, "Bayesian interpolation", 1992) weighs it against no share.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::model::prior::{Tolerance, weighed};
use crate::identify::solve::formulation::Formulation;
use crate::robot::Parameter;

/// Tolerances of the links that are weighed, mm: from the smallest, so many, each so many times the one before.
const SMALLEST_MM: f64 = 0.02;
const TOLERANCES: i32 = 36;
const STEP: f64 = 1.25;

/// Standard deviation of the target's place for this, mm: it is mounted by hand, and a place that is right by chance is
/// no proof of the scale.
const MOUNTED_MM: f64 = 100.0;

/// What is known of them: robots are built to this, mm, give or take such a factor.
const USUAL_MM: f64 = 0.4;
const GIVE_OR_TAKE: f64 = 4.0;

/// Standard deviations of a scale before the data: instruments, typing errors, units.
const SCALES: [f64; 4] = [0.003, 0.01, 0.03, 0.1];

/// Standard deviations of what one link alone is off by, mm: another size of the arm, a digit of the data sheet.
const ONE_LINK_MM: [f64; 2] = [10.0, 100.0];

/// Logarithm of the odds from which on a scale is told of, twelve to one: none of 600 clean simulated sets has as much.
const SIGNIFICANT: f64 = 2.5;

/// Chance that the scale is larger than is said of one that would not be seen.
const LARGER: f64 = 0.01;

/// Share by which all links differ from the nominal ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CommonScale {
    /// The share, larger than nominal being positive.
    pub share: f64,
    /// What the links' tolerance lets it be known to: a standard deviation.
    pub sigma: f64,
    /// Logarithm of how many times more probable the links are with it than without, be one of them off or none.
    pub log_odds: f64,
    /// The share that the readings may be off by and nothing would show it: in 1 of 100 cases it is larger.
    pub unseen: f64,
    /// What gives the robot its scale.
    pub of: &'static str,
}

impl CommonScale {
    /// Of a fit of a robot with these terms; `None` where its links were not fitted, or nothing that was measured has
    /// their scale.
    pub fn new(set: &Dataset, terms: &Terms, formulation: &Formulation) -> Option<CommonScale> {
        if terms.chain != Chain::Mdh || !formulation.scale_seen || !formulation.held {
            return None;
        }
        let (base, parameters) = (&formulation.base, formulation.parameters());
        let nominal = &formulation.rows.kinematics.nominal;
        let length = |i: usize| match parameters[i] {
            p @ (Parameter::A(_) | Parameter::D(_) | Parameter::V(_)) => nominal.value(p),
            _ => 0.0,
        };
        let extras = &formulation.rows.extras;
        let moved = |by: &dyn Fn(usize) -> f64| {
            let of_base = base.coordinates(&(0..parameters.len()).map(by).collect::<Vec<f64>>());
            DVector::from_vec(of_base).resize_vertically(base.rank() + extras.len(), 0.0)
        };
        let is_link = |i: &usize| matches!(parameters[*i], Parameter::A(_) | Parameter::D(_)) && !base.zero.contains(i);
        let links = (0..parameters.len()).filter(is_link).map(|link| moved(&|i| f64::from(i == link)));
        let (longer, links) = (moved(&length), links.collect::<Vec<_>>());
        let (normal, gradient) = formulation.normal();
        let weighed = |(lengths_mm, before): (f64, f64)| {
            let tolerance = Tolerance { lengths_mm, target_mm: MOUNTED_MM, ..formulation.tolerance };
            Weighed::new(&tolerance.covariance(base, parameters, extras), &normal, &gradient, (&longer, &links), before)
        };
        let all: Vec<Weighed> = tolerances().filter_map(weighed).collect();
        let found = summed_up(&all, if set.known.is_empty() { "readings" } else { "known distances" });
        (found.sigma.is_finite() && found.log_odds.is_finite()).then_some(found)
    }

    /// Whether it is more than the links' own errors make by chance.
    pub fn is_significant(&self) -> bool {
        self.log_odds > SIGNIFICANT
    }

    /// The scale that was found, or how large a one would not be.
    pub fn sentence(&self) -> String {
        let CommonScale { share, sigma, unseen, of, .. } = *self;
        // Only distances that are alike leave as much open: a shorter robot and a longer reading do the same to them.
        if unseen > 1.0 {
            return format!(
                "the {of} are too similar to tell a robot of another size from an offset of theirs; measure at distances that differ, or set \
                 `wire_offset = false` where the offset is zero"
            );
        }
        let (percent, way) = (100.0 * share.abs(), if share > 0.0 { "longer" } else { "shorter" });
        if !self.is_significant() {
            return format!(
                "a scale error of the {of} of up to {:.2} % cannot be told from a robot of another size",
                100.0 * unseen
            );
        }
        let (are, odds) = match self.log_odds < TOLD_APART {
            true => ("may be", format!(" (odds of {:.0} to 1)", self.log_odds.exp())),
            false => ("are", String::new()),
        };
        format!(
            "all links are found {percent:.2} % (+- {:.2}) {way} than the nominal ones: the {of} {are} scaled, along all axes or one, or the lengths of the robot \
             file{odds}",
            100.0 * sigma
        )
    }
}

/// The tolerances that are weighed, mm, and the logarithm of how probable each is before the data.
fn tolerances() -> impl Iterator<Item = (f64, f64)> {
    (0..TOLERANCES).map(|step| {
        let mm = SMALLEST_MM * STEP.powi(step);
        (mm, -0.5 * ((mm / USUAL_MM).ln() / GIVE_OR_TAKE.ln()).powi(2))
    })
}

/// The links' errors under one tolerance.
struct Weighed {
    log_evidence: f64,
    /// The same with one link, whichever, off by more than the tolerance.
    of_one_link: f64,
    precision: f64,
    pull: f64,
}

impl Weighed {
    fn new(
        covariance: &DMatrix<f64>,
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
        (longer, links): (&DVector<f64>, &[DVector<f64>]),
        before: f64,
    ) -> Option<Weighed> {
        // What is measured of the links scatters by the tolerance and the noise: with N = J'J and C the tolerance, its
        // weight is (C + N^-1)^-1 = (I + N C)^-1 N.
        let (lu, log_determinant) = weighed(normal, covariance);
        let seen = lu.solve(gradient)?;
        let of_longer = lu.solve(&(normal * longer))?;
        let log_evidence = before + 0.5 * (gradient.dot(&(covariance * &seen)) - log_determinant);
        let of_link = |link: &DVector<f64>| {
            let precision = link.dot(&lu.solve(&(normal * link))?);
            Some(ONE_LINK_MM.map(|sd_mm| gain(-link.dot(&seen), precision, sd_mm)))
        };
        let gains = links.iter().map(of_link).collect::<Option<Vec<_>>>()?.concat();
        Some(Weighed {
            log_evidence,
            of_one_link: log_evidence + log_sum(gains.iter().copied()) - (gains.len() as f64).ln(),
            precision: longer.dot(&of_longer),
            pull: -longer.dot(&seen),
        })
    }

    fn share(&self) -> f64 {
        self.pull / self.precision
    }

    /// Logarithm of the factor by which a scale of such a standard deviation makes the data more probable; with an
    /// infinite one up to a factor that all tolerances share.
    fn gain(&self, scale: f64) -> f64 {
        match scale.is_finite() {
            true => gain(self.pull, self.precision, scale),
            false => 0.5 * (self.pull.powi(2) / self.precision - self.precision.ln()),
        }
    }
}

/// Logarithm of the factor by which another unknown of this standard deviation makes the data more probable.
fn gain(pull: f64, precision: f64, sd: f64) -> f64 {
    0.5 * (pull.powi(2) / (precision + sd.powi(-2)) - (1.0 + sd * sd * precision).ln())
}

/// What all tolerances together say of a scale, each with its weight.
fn summed_up(weighed: &[Weighed], of: &'static str) -> CommonScale {
    let without = [|w: &Weighed| w.log_evidence, |w: &Weighed| w.of_one_link];
    let without = without.map(|log| log_sum(weighed.iter().map(log))).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let with = |scale: f64| log_sum(weighed.iter().map(|w| w.log_evidence + w.gain(scale)));
    let log_odds = SCALES.iter().map(|&s| with(s) - without).fold(f64::NEG_INFINITY, f64::max);
    // With any scale as probable as any other.
    let log_weight = |w: &Weighed| w.log_evidence + w.gain(f64::INFINITY);
    let total = log_sum(weighed.iter().map(log_weight));
    let mean =
        |of: &dyn Fn(&Weighed) -> f64| weighed.iter().map(|w| (log_weight(w) - total).exp() * of(w)).sum::<f64>();
    let share = mean(&|w| w.share());
    let sigma = mean(&|w| 1.0 / w.precision + (w.share() - share).powi(2)).sqrt();
    // Few links leave their tolerance open, and with it the tails: a normal distribution of this sigma has shorter
    // ones.
    let normal = Normal::standard();
    let larger = |limit: f64| {
        mean(&|w| {
            let sds = |value: f64| value * w.precision.sqrt();
            normal.cdf(sds(-limit - w.share())) + normal.sf(sds(limit - w.share()))
        })
    };
    let (mut low, mut high) = (0.0, share.abs() + 100.0 * sigma);
    while high - low > 1e-6 * high {
        let middle = 0.5 * (low + high);
        if larger(middle) > LARGER { low = middle } else { high = middle }
    }
    CommonScale { share, sigma, log_odds, unseen: high, of }
}

/// Logarithm of the sum of exponentials.
fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    largest + logs.map(|l| (l - largest).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Links of these lengths, mm, found exactly and off by so much.
    fn of_links(lengths: &[f64], off_mm: &[f64]) -> CommonScale {
        let count = lengths.len();
        let longer = DVector::from_row_slice(lengths);
        let normal = DMatrix::<f64>::identity(count, count) * 1e4;
        let gradient = DVector::from_row_slice(off_mm) * -1e4;
        let links: Vec<DVector<f64>> = normal.column_iter().map(|column| column / 1e4).collect();
        let weighed = |(mm, before): (f64, f64)| {
            let tolerance = DMatrix::identity(count, count) * mm * mm;
            Weighed::new(&tolerance, &normal, &gradient, (&longer, &links), before).unwrap()
        };
        summed_up(&tolerances().map(weighed).collect::<Vec<Weighed>>(), "readings")
    }

    #[test]
    fn a_scale_shows_where_it_is_larger_than_the_links_errors_make_it_by_chance() {
        let lengths = [400.0, -300.0, 250.0, 100.0, 50.0];
        for (error_mm, share, told) in
            [(0.5, 0.0, false), (0.5, 0.001, false), (0.5, 0.01, true), (5.0, 0.01, false), (0.02, -0.001, true)]
        {
            let errors = [0.9, 1.2, -0.7, -1.1, 0.8].map(|e| e * error_mm);
            let off_mm: Vec<f64> = errors.iter().zip(lengths).map(|(error, length)| error + share * length).collect();
            let CommonScale { log_odds, share: found, sigma, unseen, .. } = of_links(&lengths, &off_mm);
            assert!(
                unseen > found.abs() + 2.0 * sigma && unseen < found.abs() + 5.0 * sigma,
                "{found} {sigma} {unseen}"
            );
            assert_eq!(log_odds > SIGNIFICANT, told, "{error_mm} {share}: {log_odds} {found}");
            assert!((found - share).abs() < 0.005 * error_mm.max(0.1), "{error_mm} {share}: {found}");
        }
    }

    #[test]
    fn readings_that_do_not_tell_the_robots_size_are_told_without_a_figure() {
        let of = of_links(&[400.0, -300.0, 250.0, 100.0, 50.0], &[0.4, -0.2, 0.3, 0.1, -0.2]);
        assert!(of.sentence().contains("a scale error of the readings of up to"), "{}", of.sentence());
        let untold = CommonScale { share: -86.0, sigma: 79.0, unseen: 265.0, ..of };
        let said = untold.sentence();
        assert!(
            said.contains("too similar") && said.contains("`wire_offset = false`") && !said.contains('%'),
            "{said}"
        );
    }

    /// An arm of two long links, of which half of what one is off by is a scale of both.
    #[test]
    fn one_link_that_is_off_is_no_scale_of_all() {
        let lengths = [400.0, 400.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let built_mm = [0.2, -0.3, 0.3, -0.2, 0.25, -0.35, 0.1, 0.3, -0.3, 0.2, -0.15, 0.28];
        for (first_mm, second_mm, told) in [
            (-20.0, 0.0, false),
            (0.0, -20.0, false),
            (-3.0, 0.0, false),
            (-200.0, 0.0, false),
            (-20.0, -5.0, false),
            (-20.0, 12.0, false),
            (0.0, 0.0, false),
            (-20.0, -20.0, true),
            (2.0, 2.0, true),
        ] {
            let mut off_mm = built_mm;
            off_mm[0] += first_mm;
            off_mm[1] += second_mm;
            let found = of_links(&lengths, &off_mm);
            assert_eq!(found.is_significant(), told, "{first_mm} {second_mm}: {found:?}");
        }
    }
}

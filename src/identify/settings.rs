//! What can be chosen in an identification: method, model, box, swarm constants; section `[identify]` of
//! `stereocal.toml`.

use serde::{Deserialize, Serialize};

use crate::ranges::within;

/// How the parameters are searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Bounded trust region.
    TrustRegion,
    /// Sine-cosine and trust-region particle swarm, the paper's.
    Stapso,
    /// Particle swarm as in eq. (14).
    Pso,
    /// With constriction.
    Cpso,
    /// With adaptive inertia.
    Apso,
    /// Attracting and repelling by diversity.
    Arpso,
}

impl Method {
    /// All, the cheapest first: it wins a tie.
    pub const ALL: [Method; 6] =
        [Method::TrustRegion, Method::Stapso, Method::Pso, Method::Cpso, Method::Apso, Method::Arpso];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Method::TrustRegion => "trust-region",
            Method::Stapso => "stapso",
            Method::Pso => "pso",
            Method::Cpso => "cpso",
            Method::Apso => "apso",
            Method::Arpso => "arpso",
        }
    }
}

/// What counts as a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Distances to the group's centre, the paper's.
    CenterDistance,
    /// All distances within a group.
    PairwiseDistance,
    /// Points, with a free rigid transform a group.
    Position,
    /// Points and orientations.
    Pose,
}

impl Model {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Model::CenterDistance => "center-distance",
            Model::PairwiseDistance => "pairwise-distance",
            Model::Position => "position",
            Model::Pose => "pose",
        }
    }
}

/// Whether terms beyond MDH may be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Extensions {
    /// Parallel axes, gravity and harmonics as far as held-out samples get better by them.
    Auto,
    /// The paper's parameters alone.
    None,
}

/// How redundant parameters are dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Redundancy {
    /// Rank-revealing QR.
    Qr,
    /// The paper's: the largest correlation, repeatedly.
    Correlation,
}

/// Whether the manufacturing tolerance is used as a prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prior {
    /// Its size from the evidence of the data.
    Evidence,
    /// None.
    Off,
}

/// Named constants of the swarms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Constants {
    /// Those of this program: velocities limited, local search from the best particle as soon as the swarm slows down
    Shipped,
    /// Section 3.2 of the paper to the letter: no limit of the velocity, local search from every particle once the
    /// swarm has come to rest
    Paper,
}

/// Section `[identify]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// `None` (absent) runs all methods and keeps the best.
    pub method: Option<Method>,
    /// `None` (absent) chooses the model by folds.
    pub model: Option<Model>,
    /// Terms beyond MDH.
    pub extensions: Extensions,
    /// How redundant parameters are dropped.
    pub redundancy: Redundancy,
    /// Prior.
    pub prior: Prior,
    /// Half-width of the box for lengths, mm (section 3.2 of the paper).
    pub bound_mm: f64,
    /// Half-width of the box for angles, deg (section 3.2 of the paper).
    pub bound_deg: f64,
    /// Whether the box is doubled for a parameter until the trust region no longer ends at its wall.
    pub widen_bounds: bool,
    /// Relative to the longest column, below which the poses don't determine a direction. 1e-4: commands rounded to a
    /// thousandth of a degree turn a flange that should keep its orientation by about so much, and what moves the
    /// target by a ten-thousandth as far as the strongest parameter drowns in any instrument's noise.
    pub rank_tolerance: f64,
    /// Regions that are held out in turn where there are fewer than three placements, and placements held out together
    /// at the least.
    pub folds: usize,
    /// Whether units, signs, exchanged columns and the robot's convention are examined, and mended where the residuals
    /// prove a fault.
    pub examine: bool,
    /// Whether the zero of measured distances is unknown: a wire's as well as its anchor, and that of distances to a
    /// centre.
    pub wire_offset: bool,
    /// Rows that fit worse than so many robust standard deviations are left out and named; 0 keeps all.
    pub outlier_sigmas: f64,
    /// The trust region's constants.
    pub trust_region: DescentSettings,
    /// Named constants, in place of section `swarm`.
    pub constants: Option<Constants>,
    /// The swarms' constants.
    pub swarm: SwarmSettings,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            method: None,
            model: None,
            extensions: Extensions::Auto,
            redundancy: Redundancy::Qr,
            prior: Prior::Evidence,
            bound_mm: 1.0,
            bound_deg: 1.0,
            widen_bounds: true,
            rank_tolerance: 1e-4,
            folds: 10,
            examine: true,
            wire_offset: true,
            outlier_sigmas: 6.0,
            trust_region: DescentSettings::default(),
            constants: None,
            swarm: SwarmSettings::default(),
        }
    }
}

impl Settings {
    /// The swarms' constants: the named ones where there is a name.
    pub fn swarm(&self) -> SwarmSettings {
        match self.constants {
            Some(Constants::Shipped) => SwarmSettings::default(),
            Some(Constants::Paper) => SwarmSettings::paper(),
            None => self.swarm.clone(),
        }
    }

    /// Notes what makes no sense.
    pub fn validate(&self, problems: &mut Vec<String>) {
        within(problems, "identify.bound_mm", self.bound_mm, 1e-6..=1e4);
        within(problems, "identify.bound_deg", self.bound_deg, 1e-6..=180.0);
        within(problems, "identify.rank_tolerance", self.rank_tolerance, 1e-15..=0.1);
        within(problems, "identify.folds", self.folds, 2..=1000);
        within(problems, "identify.outlier_sigmas", self.outlier_sigmas, 0.0..=1e6);
        let descent = &self.trust_region;
        within(problems, "identify.trust_region.iterations", descent.iterations, 1..=100_000);
        within(problems, "identify.trust_region.radius", descent.radius, 1e-9..=1e9);
        for (name, value) in [("reduction", descent.reduction), ("step", descent.step), ("gradient", descent.gradient)]
        {
            within(problems, &format!("identify.trust_region.{name}"), value, 0.0..=1.0);
        }
        self.swarm.validate(problems);
    }
}

/// Section `[identify.trust_region]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DescentSettings {
    /// Iterations at the most.
    pub iterations: usize,
    /// First radius as a multiple of the scaled start (MINPACK: 100).
    pub radius: f64,
    /// Stop when actual and predicted reduction fall below this fraction of the cost.
    pub reduction: f64,
    /// Stop when the radius falls below this fraction of the scaled point.
    pub step: f64,
    /// Stop when the largest cosine between the residuals and a column falls below this.
    pub gradient: f64,
}

impl Default for DescentSettings {
    /// MINPACK's `lmdif1` and `lmder` defaults, with tolerances near rounding: a fit takes milliseconds.
    fn default() -> DescentSettings {
        DescentSettings { iterations: 100, radius: 100.0, reduction: 1e-13, step: 1e-12, gradient: 1e-12 }
    }
}

/// Section `[identify.swarm]`: all swarms.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SwarmSettings {
    /// M of the paper.
    pub particles: usize,
    /// K of the paper.
    pub iterations: usize,
    /// Iterations that must improve the best cost by `improvement_mm2` in all (the paper: 50); 0 never stops early.
    pub patience: usize,
    /// See `patience` (the paper: 1e-4).
    pub improvement_mm2: f64,
    /// Largest velocity as a fraction of the box's width. Eq. (14) has no inertia and diverges without one;
    /// Eberhart and Shi, "Comparing inertia weights and constriction factors" (2000), limit it by the dynamic range.
    pub velocity_limit: f64,
    /// c1 of PSO and STAPSO: 2, Kennedy and Eberhart (1995).
    pub c1: f64,
    /// c2 of PSO and STAPSO.
    pub c2: f64,
    /// c1 = c2 of CPSO: 2.05, Clerc and Kennedy (2002), with constriction 0.7298.
    pub cpso_c: f64,
    /// Inertia of APSO for the best and for poor particles: 0.4 and 0.9, Shi and Eberhart (1998), spread by fitness.
    pub apso_inertia: [f64; 2],
    /// Diversity below which ARPSO repels and above which it attracts, Riget and Vesterstrom (2002). Theirs are 5e-6
    /// and 0.25; 500 iterations in 19 dimensions never draw together so far, and the switch would stay where it is.
    pub arpso_diversity: [f64; 2],
    /// STAPSO: the constants.
    pub stapso: StapsoSettings,
}

/// Section `[identify.swarm.stapso]`: what the paper leaves open.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StapsoSettings {
    /// S: the best cost is watched over so many iterations.
    pub stagnation_iterations: usize,
    /// beta: relative to the best cost; less improvement than this over S iterations is stagnation.
    pub stagnation_improvement: f64,
    /// a of eq. (19).
    pub sine_cosine_a: f64,
    /// Particles (the best ones) that make trust-region steps when the swarm stagnates.
    pub trust_region_particles: usize,
    /// Iterations of the trust region that a particle makes each time.
    pub trust_region_steps: usize,
}

impl Default for SwarmSettings {
    fn default() -> SwarmSettings {
        SwarmSettings {
            particles: 100,
            iterations: 500,
            patience: 50,
            improvement_mm2: 1e-4,
            velocity_limit: 0.1,
            c1: 2.0,
            c2: 2.0,
            cpso_c: 2.05,
            apso_inertia: [0.4, 0.9],
            arpso_diversity: [1e-3, 0.25],
            stapso: StapsoSettings::default(),
        }
    }
}

impl Default for StapsoSettings {
    fn default() -> StapsoSettings {
        StapsoSettings {
            stagnation_iterations: 5,
            stagnation_improvement: 0.01,
            sine_cosine_a: 2.0,
            trust_region_particles: 1,
            trust_region_steps: 5,
        }
    }
}

impl SwarmSettings {
    /// Section 3.2 of the paper read to the letter. M, K, the stop after 50 iterations and a are given there and are
    /// the default's too. Eq. (14) limits no velocity, so here the box's width does; step 5 moves every particle by the
    /// trust region, whose settings are "traditional", so it runs until it converges; S and beta are not given: nothing
    /// but the stop's 50 iterations and 1e-4 says what little change is, and S must be less than 50 for the choice ever
    /// to be made.
    pub fn paper() -> SwarmSettings {
        let stapso = StapsoSettings {
            stagnation_iterations: 25,
            stagnation_improvement: 1e-4,
            trust_region_particles: 100,
            trust_region_steps: DescentSettings::default().iterations,
            ..StapsoSettings::default()
        };
        SwarmSettings { velocity_limit: 1.0, stapso, ..SwarmSettings::default() }
    }

    fn validate(&self, problems: &mut Vec<String>) {
        let at = |name: &str| format!("identify.swarm.{name}");
        within(problems, &at("particles"), self.particles, 2..=100_000);
        within(problems, &at("iterations"), self.iterations, 1..=1_000_000);
        within(problems, &at("patience"), self.patience, 0..=1_000_000);
        within(problems, &at("improvement_mm2"), self.improvement_mm2, 0.0..=1e12);
        within(problems, &at("velocity_limit"), self.velocity_limit, 1e-9..=1e3);
        within(problems, &at("c1"), self.c1, 0.0..=1e3);
        within(problems, &at("c2"), self.c2, 0.0..=1e3);
        if !(self.cpso_c > 2.0 && self.cpso_c <= 1e3) {
            problems.push(format!(
                "identify.swarm.cpso_c is {}; constriction needs more than 2, 1000 at the most",
                self.cpso_c
            ));
        }
        for (name, pair) in [("apso_inertia", self.apso_inertia), ("arpso_diversity", self.arpso_diversity)] {
            pair.iter().for_each(|value| within(problems, &at(name), *value, 0.0..=1e3));
        }
        let stapso = &self.stapso;
        within(problems, &at("stapso.stagnation_iterations"), stapso.stagnation_iterations, 1..=1_000_000);
        within(problems, &at("stapso.stagnation_improvement"), stapso.stagnation_improvement, 0.0..=1e3);
        within(problems, &at("stapso.sine_cosine_a"), stapso.sine_cosine_a, 0.0..=1e3);
        within(problems, &at("stapso.trust_region_particles"), stapso.trust_region_particles, 0..=100_000);
        within(problems, &at("stapso.trust_region_steps"), stapso.trust_region_steps, 0..=100_000);
    }
}

//! Denavit-Hartenberg parameters in the text of programs and settings.
//!
//! In: text. Out: a row a joint, alpha, a, theta, d as they stand there, and the convention where words say it. Forms:
//! links that are built one by one with named parameters (`RevoluteDH(d=0.1, a=0, alpha=pi/2)`, `Link('d', 0.1, 'a', 0,
//! ...)`, `{a: 0, alpha: 1.57, ...}`, keys one below the other); `Link([theta d a alpha])` of the Robotics Toolbox for
//! MATLAB; a list a parameter (`a = [0, -0.4, ...]`); and parameters with numbers (`alpha0: 0, a0: 0, d1: 0.3, alpha1:
//! -pi/2`). Parameters that a link's call does not name are zero. Names that the text sets to a number stand for it.
//! What goes wrong: a parameter that is no number, links of several robots, sliding joints that no call of a toolbox
//! makes; all refused with the line.

mod added;
mod calls;
mod comments;
mod ends;
mod indexed;
mod joints;
mod link;
mod lists;
mod matrix;
mod named;
mod repeated;
mod robots;
mod scan;
#[cfg(test)]
mod tests;

pub use self::ends::End;
pub use self::indexed::indexed;
pub use self::joints::Said;
pub use self::matrix::{Matrix, matrix};

use self::link::Link;
pub use self::link::{Known, Wrong};
use self::scan::Scan;
use super::dh_words::Words;
use crate::robot::catalogue::Convention;
use crate::tables::expression::Value;

/// Why a sliding joint is refused that no call of a toolbox makes.
const SLIDES: &str = "a joint slides here, which only the calls of a toolbox (`Prismatic`), `type: prismatic` beside a link's parameters and a table's column `type` say of its row: write a table, a row a joint";

#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    pub links: Option<Links>,
    pub words: Words,
    /// The names that the text sets to numbers.
    pub known: Known,
    /// What lists of parameters lack to be links.
    pub incomplete: Option<Wrong>,
    /// What lists beside the parameters say of the joints.
    pub joints: Said,
}

/// Links that a text names the parameters of.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    /// Line and parameters; of theta it is known whether the joint's variable is part of it.
    pub rows: Vec<(u64, [Value; 4])>,
    /// What the calls that make links or the numbers in names show, and how that is said.
    pub convention: Option<(Convention, &'static str)>,
    pub contradiction: Option<String>,
    pub slides: Vec<bool>,
    /// Which rows are none of joints, before the first or behind the last.
    pub still: Vec<bool>,
    /// Which joints count the other way.
    pub flipped: Vec<bool>,
    /// Whether lists or parameters with numbers make them.
    pub of_lists: bool,
    /// Whether calls of a toolbox make them, which are classic where nothing says otherwise.
    pub calls: bool,
    pub limits: Vec<Option<[Value; 2]>>,
    /// Whether the text speaks of limits, read or not.
    pub limited: bool,
    /// The base and the tool that a toolbox is told.
    pub ends: [Option<End>; 2],
    /// What was taken of them, and what was not.
    pub ends_said: Vec<String>,
}

/// Reads a text; `prose` says that it is one of sentences, without code.
pub fn read(text: &str, prose: bool) -> Result<Text, Wrong> {
    let (code, comments) = comments::split(text);
    let code = repeated::expanded(&comments::without_demonstration(&code))?;
    let words = if prose { Words::of(text, "") } else { Words::of(&comments, &code) };
    let mut scan = Scan { text: &code, line: 1, ..Scan::default() };
    scan.run()?;
    let lower = code.to_lowercase();
    let says = ["'prismatic'", "\"prismatic\"", ": prismatic"].iter().find_map(|word| lower.find(word));
    if let Some(at) = says.filter(|_| scan.links.len() > 1 && !scan.links.iter().any(|link| link.slides)) {
        return Err((1 + lower[..at].matches('\n').count() as u64, SLIDES.to_owned()));
    }
    added::none(&code, &scan.links)?;
    // What a loop takes out of lists is read from the lists.
    if scan.wrong.is_none() {
        repeated::refuse_unwritten(&code, &scan.links)?;
    }
    robots::of_one(&code, &scan.links.iter().map(|link| link.line).collect::<Vec<_>>())?;
    named::of_one_list(&scan.links)?;
    let (known, incomplete) = (std::mem::take(&mut scan.known), lists::incomplete(&scan.lists, &scan.families));
    let joints = if prose { Said::default() } else { joints::said(&code, &known)? };
    let mut links = links(scan, lower.contains("qlim"))?;
    if let Some(links) = links.as_mut().filter(|links| links.calls) {
        let (ends, said) = ends::of(&code, &known);
        links.ends = ends;
        links.ends_said.extend(said);
    }
    if let Some(links) = links.as_mut() {
        links.told(&joints)?;
    }
    Ok(Text { links, words, known, incomplete, joints })
}

/// The links of what was read; none where there are fewer than two.
fn links(scan: Scan, limited: bool) -> Result<Option<Links>, Wrong> {
    let Scan { mut links, lists, families, numbered, wrong, .. } = scan;
    let others = || -> Result<(Vec<Link>, Option<Convention>), Wrong> {
        let of_lists = lists::links(&lists, &families)?;
        Ok(if of_lists.is_empty() { lists::numbered_links(&numbered) } else { (of_lists, None) })
    };
    // What a loop takes out of lists is no number where the link is made.
    if let Some(wrong) = wrong.or_else(|| links.iter().find_map(Link::unsaid)) {
        links = Vec::new();
        if others()?.0.len() < 2 {
            return Err(wrong);
        }
    }
    // A lone key is one of something else.
    links.retain(|link| link.call || link.values.iter().flatten().count() > 1);
    if links.len() > 1 {
        let has = |link: &Link| link.values.map(|v| v.is_some());
        if let Some(odd) = links.iter().find(|link| !link.call && has(link) != has(&links[0])) {
            return Err((odd.line, "this link has other parameters than the first".to_owned()));
        }
    }
    let mut shown = None;
    let of_lists = links.len() < 2;
    if of_lists {
        (links, shown) = others()?;
    }
    if links.len() < 2 {
        return Ok(None);
    }
    let rows = links.iter().map(|link| Ok((link.line, link.row()?)));
    let (of_calls, contradiction) = match link::convention(&links) {
        Ok(of_calls) => (of_calls, None),
        Err(contradiction) => (None, Some(contradiction)),
    };
    Ok(Some(Links {
        rows: rows.collect::<Result<_, Wrong>>()?,
        contradiction,
        slides: links.iter().map(|link| link.slides).collect(),
        still: named::still(&links),
        flipped: links.iter().map(|link| link.flipped).collect(),
        convention: of_calls
            .map(|c| (c, "the calls that make its links say so"))
            .or(shown.map(|c| (c, "alpha and a are numbered from 0, d from 1"))),
        of_lists,
        calls: links.iter().any(|link| link.call),
        limits: links.iter().map(|link| link.limits).collect(),
        limited,
        ends: [None; 2],
        ends_said: named::said(&links),
    }))
}

impl Links {
    /// Takes from a list which joints slide, and says which offsets stand apart.
    fn told(&mut self, joints: &Said) -> Result<(), Wrong> {
        let said = self.slides.contains(&true);
        if let Some(slides) = joints.slides(self.rows.len(), &self.still)? {
            if said && slides != self.slides {
                let (line, name) = joints.kinds.as_ref().map_or((1, ""), |kinds| (kinds.line, &kinds.name));
                return Err((line, format!("`{name}` says of other joints that they slide than the links do")));
            }
            self.slides = slides;
        }
        Ok(())
    }
}

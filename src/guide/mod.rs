//! The guide for the practitioner: how to make boards, mount cameras, take pictures and choose poses.
//!
//! The pages stand here as part of the documentation; `stereocal guide TOPIC` prints them without a network. The commands in their
//! `sh` blocks are run by a test, with the files that stand in `csv NAME` blocks.

#[doc = include_str!("boards.md")]
pub mod boards {}
#[doc = include_str!("cameras.md")]
pub mod cameras {}
#[doc = include_str!("pictures.md")]
pub mod pictures {}
#[doc = include_str!("poses.md")]
pub mod poses {}
#[doc = include_str!("day.md")]
pub mod day {}
#[doc = include_str!("robot.md")]
pub mod robot {}
#[doc = include_str!("tables.md")]
pub mod tables {}
#[doc = include_str!("warnings.md")]
pub mod warnings {}

/// A page of the guide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// What to ask for it by.
    pub topic: &'static str,
    /// Its text, in Markdown.
    pub text: &'static str,
}

/// All pages, in the order in which they are needed.
pub const PAGES: [Page; 9] = [
    Page { topic: "day", text: include_str!("day.md") },
    Page { topic: "boards", text: include_str!("boards.md") },
    Page { topic: "cameras", text: include_str!("cameras.md") },
    Page { topic: "pictures", text: include_str!("pictures.md") },
    Page { topic: "poses", text: include_str!("poses.md") },
    Page { topic: "robot", text: include_str!("robot.md") },
    Page { topic: "tables", text: include_str!("tables.md") },
    Page { topic: "warnings", text: include_str!("warnings.md") },
    Page { topic: "conventions", text: include_str!("../CONVENTIONS.md") },
];

/// The page of a topic.
pub fn page(topic: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.topic == topic)
}

impl Page {
    /// Its title.
    pub fn title(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches(['#', ' '])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_has_a_title_and_a_topic_of_its_own() {
        for (i, found) in PAGES.iter().enumerate() {
            assert!(found.text.starts_with("# ") && !found.title().is_empty(), "{}", found.topic);
            assert!(PAGES[..i].iter().all(|other| other.topic != found.topic));
            assert_eq!(page(found.topic), Some(found));
        }
        assert_eq!(page("nothing"), None);
    }
}

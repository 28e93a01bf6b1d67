//! The guide for the practitioner: how to make boards, mount cameras, take pictures and choose poses, and what the
//! program reaches.
//!
//! `stereocal guide TOPIC` prints a page without a network, `stereocal guide --html DIR` makes one HTML file of all.
//! The commands in `sh` blocks are run by a test, with the files that stand in `csv NAME` blocks; the pictures of
//! boards are rendered and read by another.

/// A page of the guide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// What to ask for it by.
    pub topic: &'static str,
    /// Its text, in Markdown.
    pub text: &'static str,
}

/// All pages: first those that are needed in the cell, in that order, then those that are looked up.
pub const PAGES: [Page; 15] = [
    Page { topic: "day", text: include_str!("day.md") },
    Page { topic: "boards", text: include_str!("boards.md") },
    Page { topic: "cameras", text: include_str!("cameras.md") },
    Page { topic: "pictures", text: include_str!("pictures.md") },
    Page { topic: "poses", text: include_str!("poses.md") },
    Page { topic: "again", text: include_str!("again.md") },
    Page { topic: "placement", text: include_str!("placement.md") },
    Page { topic: "robot", text: include_str!("robot.md") },
    Page { topic: "tables", text: include_str!("tables.md") },
    Page { topic: "warnings", text: include_str!("warnings.md") },
    Page { topic: "accuracy", text: include_str!("accuracy.md") },
    Page { topic: "limits", text: include_str!("limits.md") },
    Page { topic: "peers", text: include_str!("peers.md") },
    Page { topic: "formats", text: include_str!("formats.md") },
    Page { topic: "conventions", text: include_str!("../CONVENTIONS.md") },
];

/// A picture that stands in a page.
#[derive(Debug, Clone, Copy)]
pub struct Picture {
    /// Where a page says that it is.
    pub path: &'static str,
    /// The file.
    pub bytes: &'static [u8],
}

macro_rules! pictures {
    ($($path:literal),* $(,)?) => { [$(Picture { path: $path, bytes: include_bytes!($path) }),*] };
}

/// All pictures of the pages.
pub const PICTURES: [Picture; 9] = pictures![
    "pictures/way.svg",
    "pictures/good.png",
    "pictures/glare.png",
    "pictures/cut.png",
    "pictures/blurred.png",
    "pictures/dark.png",
    "pictures/small.png",
    "pictures/spread.png",
    "pictures/alike.png",
];

/// Commands, and the page that is about each.
const COMMANDS: [(&str, &str); 15] = [
    ("camera-check", "pictures"),
    ("measure", "poses"),
    ("identify", "robot"),
    ("verify", "again"),
    ("locate", "placement"),
    ("board", "boards"),
    ("report", "day"),
    ("rectify", "formats"),
    ("simulate", "accuracy"),
    ("plan", "poses"),
    ("compensate", "robot"),
    ("export", "formats"),
    ("init", "formats"),
    ("guide", "day"),
    ("man", "formats"),
];

/// The page of a topic, in any case, or of a command.
pub fn page(topic: &str) -> Option<&'static Page> {
    let topic = topic.to_lowercase();
    let of_command = COMMANDS.iter().find(|(command, _)| *command == topic).map(|(_, page)| *page);
    PAGES.iter().find(|page| page.topic == of_command.unwrap_or(&topic))
}

impl Page {
    pub fn title(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches(['#', ' '])
    }

    /// The page as a terminal shows it: what a picture shows in words in place of the picture, and the rows of a wide
    /// table as lists of their cells.
    pub fn plain(&self) -> String {
        let mut plain = String::with_capacity(self.text.len());
        let mut rest = self.text;
        while let Some((before, after)) = rest.split_once("![") {
            let Some((words, behind)) =
                after.split_once("](").and_then(|(words, path)| Some((words, path.split_once(')')?.1)))
            else {
                break;
            };
            plain.extend([before, "[picture: ", words, "]"]);
            rest = behind;
        }
        with_narrow_tables(&(plain + rest))
    }
}

/// Columns of a terminal that a line of the pages keeps to.
const COLUMNS: usize = 100;

/// The text with each row of a table that is wider than a terminal as a list: its first cell, then each other one below
/// the name of its column.
fn with_narrow_tables(text: &str) -> String {
    let mut narrow = String::with_capacity(text.len());
    let mut lines = text.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        if line.starts_with("[picture: ") && line.chars().count() > COLUMNS {
            narrow += &wrapped(line.trim_end(), ["", ""]);
            continue;
        }
        if !line.starts_with('|') {
            narrow.push_str(line);
            continue;
        }
        let mut table = vec![line];
        while let Some(row) = lines.next_if(|row| row.starts_with('|')) {
            table.push(row);
        }
        if table.iter().all(|row| row.chars().count() <= COLUMNS + 1) {
            narrow.extend(table);
            continue;
        }
        let cells = |row: &str| -> Vec<String> {
            row.trim().trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned()).collect()
        };
        let header = cells(table[0]);
        for row in table.iter().skip(2).map(|row| cells(row)) {
            for (k, (name, cell)) in header.iter().zip(&row).enumerate().filter(|(_, (_, cell))| !cell.is_empty()) {
                let said = if k == 0 || name.is_empty() { cell.clone() } else { format!("{name}: {cell}") };
                narrow += &wrapped(&said, if k == 0 { ["- ", "  "] } else { ["  ", "    "] });
            }
        }
    }
    narrow
}

/// Words in lines of at most [`COLUMNS`], the first and the others with their indents.
fn wrapped(text: &str, [first, others]: [&str; 2]) -> String {
    let (mut lines, mut line) = (String::new(), first.to_owned());
    let mut is_empty = true;
    for word in text.split(' ') {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > COLUMNS {
            lines += &format!("{line}\n");
            (line, is_empty) = (others.to_owned(), true);
        }
        line += &format!("{}{word}", if is_empty { "" } else { " " });
        is_empty = false;
    }
    lines + &line + "\n"
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
        assert_eq!(page("Warnings"), page("warnings"));
        assert!(COMMANDS.iter().all(|(command, _)| page(command).is_some()));
        assert_eq!(page("camera-check"), page("pictures"));
    }

    #[test]
    fn every_picture_stands_in_a_page_and_every_page_has_its_pictures() {
        let asked: Vec<&str> = PAGES
            .iter()
            .flat_map(|page| page.text.split("](pictures/").skip(1))
            .filter_map(|rest| rest.split(')').next())
            .collect();
        for name in &asked {
            assert!(PICTURES.iter().any(|picture| picture.path == format!("pictures/{name}")), "{name}");
        }
        for picture in PICTURES {
            assert!(asked.iter().any(|name| picture.path.ends_with(name)), "{} stands in no page", picture.path);
        }
    }

    #[test]
    fn lines_of_a_terminal_are_not_longer_than_it_is_wide() {
        for page in PAGES {
            let text = page.plain();
            let mut is_code = false;
            for line in text.lines() {
                is_code ^= line.starts_with("```");
                let words = line.trim_start().matches(' ').count();
                assert!(line.chars().count() <= COLUMNS || is_code || words < 5, "{}: {line}", page.topic);
            }
        }
        let narrow = with_narrow_tables("a\n| it says | do |\n|---|---|\n| b | c |\n");
        assert_eq!(narrow, "a\n| it says | do |\n|---|---|\n| b | c |\n");
        let wide = format!("| it says | do |\n|---|---|\n| b | {} |\n| d | |\nend\n", "word ".repeat(30).trim());
        let narrow = with_narrow_tables(&wide);
        assert!(narrow.starts_with("- b\n  do: word word") && narrow.ends_with("word\n- d\nend\n"), "{narrow}");
    }

    #[test]
    fn a_terminal_reads_what_a_picture_shows() {
        let page = Page { topic: "t", text: "a ![a board](pictures/x.png) b\n![c](d) ![open" };
        assert_eq!(page.plain(), "a [picture: a board] b\n[picture: c] ![open");
    }
}

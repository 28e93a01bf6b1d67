//! A program's text without its comments, and its comments.

/// Marks of the beginning and of the end of a comment over several lines, or of a text that is one.
const BLOCKS: [(&str, &str); 4] = [("\"\"\"", "\"\"\""), ("'''", "'''"), ("/*", "*/"), ("%{", "%}")];

/// Where a comment begins that goes to the end of the line.
pub(super) fn start(line: &str) -> usize {
    ["#", "%", "//"].iter().filter_map(|mark| line.find(mark)).min().unwrap_or(line.len())
}

/// The text with comments as blanks, so that lines stay where they are, and the comments.
pub(super) fn split(text: &str) -> (String, String) {
    let (mut plain, mut comments) = (String::with_capacity(text.len()), String::new());
    let mut quoted: Option<&str> = None;
    for line in text.lines() {
        let mut rest = line;
        while !rest.is_empty() {
            if let Some(mark) = quoted {
                let Some(end) = rest.find(mark) else {
                    comments.push_str(rest);
                    break;
                };
                comments.push_str(&rest[..end]);
                (rest, quoted) = (&rest[end + mark.len()..], None);
                continue;
            }
            let comment = start(rest);
            let opened = |(open, close): &(&str, &'static str)| Some((rest.find(open)?, *close, open.len()));
            // `path/*` opens none, and `%{` does alone on its line.
            let opens = |(open, close): &&(&str, &str)| match *open {
                "/*" => text.contains(close),
                "%{" => rest.trim() == *open && text.contains(close),
                _ => true,
            };
            let blocks = BLOCKS.iter().filter(opens);
            match blocks.filter_map(opened).min() {
                Some((start, close, length)) if start <= comment => {
                    plain.push_str(&rest[..start]);
                    (rest, quoted) = (&rest[start + length..], Some(close));
                }
                _ => {
                    plain.push_str(&rest[..comment]);
                    comments.push_str(&rest[comment..]);
                    break;
                }
            }
        }
        plain.push('\n');
        comments.push('\n');
    }
    (plain, comments)
}

/// The text without what Python runs of a file by itself alone, `if __name__ == "__main__":`, as empty lines: that
/// shows how a robot is used.
pub(super) fn without_demonstration(code: &str) -> String {
    let mut shows = false;
    let mut plain = String::with_capacity(code.len());
    for line in code.lines() {
        let stands_out = !line.starts_with([' ', '\t']) && !line.trim().is_empty();
        shows = if stands_out { line.starts_with("if __name__") } else { shows };
        plain.push_str(if shows { "" } else { line });
        plain.push('\n');
    }
    plain
}

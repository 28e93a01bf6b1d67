//! What is wrong in a JSON or TOML file, in the words of the file's format.

/// That a line of TOML has a number with a comma.
pub fn decimal_comma(line: &str) -> Option<String> {
    let (_, value) = line.split_once('=')?;
    let value = value.split('#').next()?.trim();
    let (whole, decimals) = value.split_once(',')?;
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    let is_comma = is_number(whole.trim_start_matches(['-', '+'])) && is_number(decimals);
    is_comma.then(|| format!("`{value}` has a comma where a point is needed: {whole}.{decimals}"))
}

/// The line of a byte of the text, counted from 1.
pub fn line_at(text: &str, at: usize) -> u64 {
    1 + text[..at.min(text.len())].matches('\n').count() as u64
}

/// The line in which a key of TOML stands first that is refused at `second`: that in which another name in its place
/// lets the reader come beyond that. The reader does not say it, and keys of other tables have the same names.
pub fn first_of_key(text: &str, key: &str, second: usize) -> Option<u64> {
    let refused_at = |text: &str| text.parse::<toml::Table>().err().and_then(|e| e.span()).map(|span| span.start);
    if refused_at(text) != Some(second) {
        return None;
    }
    let first = text[..second].match_indices(key).map(|(at, _)| at).find(|&at| {
        let renamed = format!("{}{key}{}", &text[..at], &text[at..]);
        refused_at(&renamed).is_none_or(|at| at > second + key.len())
    })?;
    Some(line_at(text, first))
}

/// A message of the readers of JSON and TOML in the words of the file's format, as their own name types of the source;
/// without the place, which is said apart.
pub fn plain(message: &str) -> String {
    let message = message.split(" at line ").next().unwrap_or(message);
    let prefixed = |prefix: &str| message.strip_prefix(prefix);
    if let Some(key) = prefixed("missing field ") {
        return format!("{key} is missing");
    }
    if let Some((key, known)) = prefixed("unknown field ").and_then(|rest| rest.split_once(", expected ")) {
        return format!("unknown key {key}; there are {}", known.trim_start_matches("one of "));
    }
    if let Some(key) = prefixed("duplicate field ") {
        return format!("{key} stands there twice");
    }
    let of_type = prefixed("invalid type: ").or(prefixed("invalid value: "));
    if let Some((found, needed)) = of_type.and_then(|rest| rest.split_once(", expected ")) {
        return format!("{} stands where {} is needed", found_in_words(found), needed_in_words(needed));
    }
    if let Some((found, needed)) = prefixed("invalid length ").and_then(|rest| rest.split_once(", expected ")) {
        return format!("{found} values stand where {} is needed", needed_in_words(needed));
    }
    message.to_owned()
}

fn found_in_words(found: &str) -> String {
    match found {
        "sequence" => "a list".to_owned(),
        "map" => "a table of keys".to_owned(),
        "null" => "`null`".to_owned(),
        other => ["integer", "floating point", "boolean"].iter().fold(other.to_owned(), |said, kind| {
            said.strip_prefix(&format!("{kind} ")).map_or(said.clone(), str::to_owned)
        }),
    }
}

fn needed_in_words(needed: &str) -> String {
    match needed {
        "f64" | "f32" => "a number".to_owned(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number".to_owned(),
        "a string" | "string" => "text in quotes".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        other if other.starts_with("struct ") || other == "a map" => "a table of keys".to_owned(),
        other => other.strip_prefix("an array of length ").map_or(other.to_owned(), |n| format!("a list of {n}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readers_are_quoted_without_the_types_of_the_source() {
        for (message, said) in [
            ("missing field `fx` at line 18 column 3", "`fx` is missing"),
            ("unknown field `b_mm`, expected one of `a_mm`, `d_mm`", "unknown key `b_mm`; there are `a_mm`, `d_mm`"),
            ("duplicate field `name`", "`name` stands there twice"),
            (
                "invalid type: string \"a\", expected f64 at line 6 column 13",
                "string \"a\" stands where a number is needed",
            ),
            ("invalid type: integer `3`, expected a string", "`3` stands where text in quotes is needed"),
            ("invalid type: sequence, expected f64", "a list stands where a number is needed"),
            ("invalid length 2, expected an array of length 3", "2 values stand where a list of 3 is needed"),
            (
                "invalid length 0, expected struct File with 12 elements",
                "0 values stand where a table of keys is needed",
            ),
            ("key with no value, expected `=`", "key with no value, expected `=`"),
        ] {
            assert_eq!(plain(message), said);
        }
    }

    #[test]
    fn the_first_line_of_a_key_is_told_whatever_stands_in_other_tables() {
        for (text, key, first) in [
            ("a = 1\n[t]\na = \"a\"\nb = 2\n'a' = 3\n", "'a'", None),
            ("a = 1\n[t]\na = \"a\"\nb = 2\na = 3\n", "a", Some(3)),
            ("[t]\nx = [\n1, 2]\n[s]\nx = 1\n[t]\n", "t", Some(1)),
            ("[[j]]\nx = 1\n[[j]]\nx = 1\ny = 2\nx = 3\nx = 4\n", "x", Some(4)),
            ("[[j]]\nx = 1\n[[j]]\nx = = 1\n", "x", None),
        ] {
            let second = text.parse::<toml::Table>().unwrap_err().span().unwrap().start;
            assert_eq!(first_of_key(text, key, second), first, "{text}");
        }
    }

    #[test]
    fn a_number_with_a_comma_is_told() {
        let said = decimal_comma("tolerance_mm = 1,5 # mm").unwrap();
        assert_eq!(said, "`1,5` has a comma where a point is needed: 1.5");
        assert!(decimal_comma("x = -0,25").is_some());
        for line in ["x = [1,5]", "x = \"1,5\"", "x = 1.5", "# 1,5", "x = 1,", "x = a,5"] {
            assert_eq!(decimal_comma(line), None, "{line}");
        }
    }
}

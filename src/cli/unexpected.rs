//! What was likely meant by a word that no command takes.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};

/// Names of values that are files or folders.
const PLACES: [&str; 2] = ["FILE", "DIR"];

/// Endings of files that are named by their folder alone.
const PICTURES: [&str; 5] = [".png", ".jpg", ".jpeg", ".tif", ".bmp"];

/// Units of length that people write behind a number, mm.
const UNITS_MM: [(&str, f64); 7] =
    [("mm", 1.0), ("cm", 10.0), ("um", 1e-3), ("inch", 25.4), ("in", 25.4), ("\"", 25.4), ("m", 1000.0)];

/// What was likely meant. `words` are those of the command line behind the program's name.
pub fn hint(root: &Command, words: &[String], error: &clap::Error) -> Option<String> {
    let command = words.iter().fold(root, |at, word| at.find_subcommand(word).unwrap_or(at));
    match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (ErrorKind::UnknownArgument, Some(ContextValue::String(given))) => without_flag(command, given),
        (ErrorKind::ValueValidation, Some(ContextValue::String(flag))) => match error.get(ContextKind::InvalidValue) {
            Some(ContextValue::String(value)) => as_mm(flag, value),
            _ => None,
        },
        (ErrorKind::MissingRequiredArgument, Some(ContextValue::Strings(missing))) => choices(command, missing),
        (ErrorKind::InvalidSubcommand, _) if command.get_name() != root.get_name() => {
            let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            Some(format!("`{}` takes one of {}", command.get_name(), names.join(", ")))
        }
        _ => None,
    }
}

/// For a length with a unit or a decimal comma: the number that the flag takes.
fn as_mm(flag: &str, value: &str) -> Option<String> {
    let name = flag.strip_suffix(" <MM>")?;
    let value = value.trim().to_lowercase().replace(',', ".");
    let (number, of_one) =
        UNITS_MM.iter().find_map(|(unit, mm)| Some((value.strip_suffix(unit)?, *mm))).unwrap_or((value.as_str(), 1.0));
    let mm = of_one * number.trim().parse::<f64>().ok()?;
    let text = format!("{mm:.4}");
    Some(format!("mm without a unit: `{name} {}`", text.trim_end_matches('0').trim_end_matches('.')))
}

/// For flags that are missing: what they take, where that is one of a few words.
fn choices(command: &Command, missing: &[String]) -> Option<String> {
    let of = |arg: &Arg| {
        let long = arg.get_long()?;
        let is_missing = missing.iter().any(|flag| flag.starts_with(&format!("--{long} ")));
        let words: Vec<String> = arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        (is_missing && !words.is_empty()).then(|| format!("`--{long}` takes one of {}", words.join(", ")))
    };
    command.get_arguments().find_map(of)
}

/// For a file that is named without its flag: the flags that take one.
fn without_flag(command: &Command, given: &str) -> Option<String> {
    if given.starts_with('-') {
        return None;
    }
    if PICTURES.iter().any(|ending| given.to_lowercase().ends_with(ending)) {
        return Some(
            "pictures are named by their folder, or by one for the left and one for the right camera".to_owned(),
        );
    }
    let takes_a_place = |arg: &&Arg| {
        arg.get_value_names().is_some_and(|names| names.iter().any(|name| PLACES.contains(&name.as_str())))
    };
    let flags: Vec<String> = command
        .get_arguments()
        .filter(takes_a_place)
        .filter_map(|arg| Some(format!("`--{} {given}`", arg.get_long()?)))
        .collect();
    let (last, first) = flags.split_last()?;
    let list = if first.is_empty() { last.clone() } else { format!("{} or {last}", first.join(", ")) };
    Some(format!("files are named by their flags here: {list}"))
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::cli::Cli;

    fn of(words: &[&str]) -> Option<String> {
        let words: Vec<String> = words.iter().map(|w| (*w).to_owned()).collect();
        let error = Cli::try_parse_from(std::iter::once("stereocal".to_owned()).chain(words.clone())).unwrap_err();
        hint(&Cli::command(), &words, &error)
    }

    #[test]
    fn a_file_without_its_flag_is_answered_with_the_flags_that_take_one() {
        let said = of(&["identify", "points.csv"]).unwrap();
        assert!(said.contains("`--measurements points.csv`") && said.contains("or `--out points.csv`"), "{said}");
        assert!(of(&["--quiet", "camera-check", "left", "right", "more"]).unwrap().contains("--out"));
    }

    #[test]
    fn lengths_with_a_unit_are_answered_in_mm() {
        let said = |value: &str| of(&["camera-check", "x", "--square-mm", value]).unwrap();
        for (value, mm) in
            [("20mm", "20"), ("2 cm", "20"), ("0.787in", "19.9898"), ("1\"", "25.4"), ("19,5", "19.5"), ("0.02m", "20")]
        {
            assert!(said(value).ends_with(&format!("`--square-mm {mm}`")), "{value}: {}", said(value));
        }
        assert_eq!(of(&["camera-check", "x", "--square-mm", "wide"]), None);
    }

    #[test]
    fn what_is_missing_or_unknown_is_answered_with_the_words_there_are() {
        assert_eq!(of(&["export", "calibration"]).unwrap(), "`--format` takes one of opencv, ros, kalibr, mrcal");
        assert!(of(&["export", "opencv"]).unwrap().starts_with("`export` takes one of calibration, robot, placement"));
        assert_eq!(of(&["calibrate"]), None);
        assert!(of(&["camera-check", "l/1.png", "l/2.png", "l/3.PNG"]).unwrap().contains("by their folder"));
    }

    #[test]
    fn other_slips_are_left_to_the_parser() {
        assert_eq!(of(&["identify", "--sped", "3"]), None);
        assert_eq!(of(&["identify", "--seed", "x"]), None);
        assert_eq!(of(&["identfy", "points.csv"]), None);
    }
}

//! What was likely meant by a word that no command takes.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};

use crate::diagnostic::slips;

/// Names of values that are files or folders.
const PLACES: [&str; 2] = ["FILE", "DIR"];

/// Endings of files that are named by their folder alone.
const PICTURES: [&str; 5] = [".png", ".jpg", ".jpeg", ".tif", ".bmp"];

/// Words that people make a flag of for what a command takes without one: pictures, poses, targets.
const WITHOUT_FLAG: [&str; 8] = ["images", "pictures", "poses", "measurements", "table", "targets", "program", "file"];

/// Words for a flag that share none with its name.
const OTHER_WORDS: [(&str, &str); 8] = [
    ("squares", "board"),
    ("data", "measurements"),
    ("table", "measurements"),
    ("points", "measurements"),
    ("measurements", "after"),
    ("nominal", "robot"),
    ("rig", "calibration"),
    ("cameras", "calibration"),
];

/// Units of length that people write behind a number, mm.
const UNITS_MM: [(&str, f64); 7] =
    [("mm", 1.0), ("cm", 10.0), ("um", 1e-3), ("inch", 25.4), ("in", 25.4), ("\"", 25.4), ("m", 1000.0)];

/// The parser's message and what was likely meant. Its tips stay where they are a slip of the keys away; a word that
/// only shares letters with the one that was typed is worse than none. `words` are those of the command line behind the
/// program's name.
pub fn mended(root: &Command, words: &[String], mut error: clap::Error) -> (clap::Error, Option<String>) {
    const TIPS: [(ContextKind, ContextKind); 3] = [
        (ContextKind::SuggestedSubcommand, ContextKind::InvalidSubcommand),
        (ContextKind::SuggestedArg, ContextKind::InvalidArg),
        (ContextKind::SuggestedValue, ContextKind::InvalidValue),
    ];
    for (tip, typed) in TIPS {
        let typed = match error.get(typed) {
            Some(ContextValue::String(typed)) => typed.clone(),
            _ => continue,
        };
        let near: Vec<String> = match error.remove(tip) {
            Some(ContextValue::String(word)) => vec![word],
            Some(ContextValue::Strings(words)) => words,
            _ => continue,
        };
        let near: Vec<String> = near.into_iter().filter(|word| slips(&typed, word).is_some()).collect();
        match &near[..] {
            [] => {}
            [one] => _ = error.insert(tip, ContextValue::String(one.clone())),
            _ => _ = error.insert(tip, ContextValue::Strings(near)),
        }
    }
    let mut built = root.clone();
    built.build();
    let command = words.iter().fold(&built, |at, word| at.find_subcommand(word).unwrap_or(at));
    // The parser's own line leaves out what is optional, or has a flag that was typed as if it were required; and no
    // flag is meant as a value here.
    if error.get(ContextKind::Usage).is_some() {
        error.insert(ContextKind::Usage, ContextValue::StyledStr(command.clone().render_usage()));
    }
    if error.kind() == ErrorKind::UnknownArgument {
        error.remove(ContextKind::Suggested);
    }
    let hint = hint(&built, command, &error);
    (error, hint)
}

fn hint(root: &Command, command: &Command, error: &clap::Error) -> Option<String> {
    match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (ErrorKind::UnknownArgument, Some(ContextValue::String(given))) => {
            without_flag(command, given).or_else(|| named_otherwise(command, given, error))
        }
        (ErrorKind::ValueValidation, Some(ContextValue::String(flag))) => match error.get(ContextKind::InvalidValue) {
            Some(ContextValue::String(value)) => as_mm(flag, value),
            _ => None,
        },
        (ErrorKind::MissingRequiredArgument, Some(ContextValue::Strings(missing))) => {
            choices(command, missing).or_else(|| in_place_of(command, missing))
        }
        (ErrorKind::InvalidSubcommand, _) if command.get_name() != root.get_name() => {
            let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            Some(format!("`{}` takes one of {}", command.get_name(), names.join(", ")))
        }
        (ErrorKind::InvalidSubcommand, _) if error.get(ContextKind::SuggestedSubcommand).is_none() => Some(
            "`camera-check` calibrates the cameras, `identify` the robot; `stereocal --help` lists all commands"
                .to_owned(),
        ),
        _ => None,
    }
}

/// For a flag that there is not: what is named without one, or the flags of another name, those that share most of its
/// words: `--square-mm` for `--square-size`.
fn named_otherwise(command: &Command, given: &str, error: &clap::Error) -> Option<String> {
    const MOST: usize = 4;
    let name = given.strip_prefix("--")?;
    let typed: Vec<&str> = name.split('-').collect();
    if error.get(ContextKind::SuggestedArg).is_some() {
        return None;
    }
    if let Some(first) = command.get_positionals().next().filter(|_| WITHOUT_FLAG.contains(&name)) {
        let value = first.get_value_names().and_then(|names| names.first())?;
        let command = command.get_bin_name().unwrap_or(command.get_name());
        return Some(format!("it is named without a flag: `{command} {value}`"));
    }
    let other = |(word, flag): &(&str, &str)| {
        let arg = command.get_arguments().find(|arg| *word == name && arg.get_long() == Some(flag))?;
        Some(format!("there is {}", with_value(arg)))
    };
    if let Some(said) = OTHER_WORDS.iter().find_map(other) {
        return Some(said);
    }
    // The words that both have, of all that either has, in thousandths.
    let shared = |arg: &Arg| {
        let own: Vec<&str> = arg.get_long()?.split('-').collect();
        let both = own.iter().filter(|word| typed.contains(word)).count();
        (both > 0).then(|| 1000 * both / (own.len() + typed.len() - both))
    };
    let best = command.get_arguments().filter_map(shared).max()?;
    let flags = command.get_arguments().filter(|arg| shared(arg) == Some(best)).take(MOST);
    let flags: Vec<String> = flags.map(with_value).collect();
    Some(format!("there is {}", flags.join(" and ")))
}

/// A flag with what it takes: `--square-mm MM`.
fn with_value(arg: &Arg) -> String {
    let names = arg.get_value_names().filter(|_| arg.get_action().takes_values());
    let value = names.and_then(|names| names.first().map(|name| format!(" {name}")));
    format!("`--{}{}`", arg.get_long().unwrap_or_default(), value.unwrap_or_default())
}

/// Whether a flag is among those that are missing, as the parser writes them.
fn is_among(arg: &Arg, missing: &[String]) -> bool {
    arg.get_long().is_some_and(|long| missing.iter().any(|flag| flag.starts_with(&format!("--{long} "))))
}

/// For flags that are missing: others that do in their place.
fn in_place_of(command: &Command, missing: &[String]) -> Option<String> {
    let asked = command.get_arguments().find(|arg| is_among(arg, missing))?;
    let instead = command.get_arguments().find(|other| {
        other.get_long().is_some()
            && command.get_arg_conflicts_with(other).iter().any(|arg| arg.get_id() == asked.get_id())
    })?;
    let value = instead.get_value_names().and_then(|names| names.first())?;
    Some(format!("or `--{} {value}` in its place", instead.get_long()?))
}

/// For a length with a unit or a decimal comma: the number that the flag takes.
fn as_mm(flag: &str, value: &str) -> Option<String> {
    let name = flag.strip_suffix(" <MM>")?;
    // One that is a number is not in the flag's range.
    if value.trim().parse::<f64>().is_ok() {
        return None;
    }
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
        let words: Vec<String> = arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        (is_among(arg, missing) && !words.is_empty()).then(|| format!("`--{long}` takes one of {}", words.join(", ")))
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
    // What has an ending is a file.
    let places = if camino::Utf8Path::new(given).extension().is_some() { &PLACES[..1] } else { &PLACES[..] };
    let takes_a_place = |arg: &&Arg| {
        arg.get_value_names().is_some_and(|names| names.iter().any(|name| places.contains(&name.as_str())))
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

    fn answered(words: &[&str]) -> (String, Option<String>) {
        let words: Vec<String> = words.iter().map(|w| (*w).to_owned()).collect();
        let error = Cli::try_parse_from(std::iter::once("stereocal".to_owned()).chain(words.clone())).unwrap_err();
        let (error, hint) = mended(&Cli::command(), &words, error);
        (error.to_string(), hint)
    }

    fn of(words: &[&str]) -> Option<String> {
        answered(words).1
    }

    #[test]
    fn a_file_without_its_flag_is_answered_with_the_flags_that_take_one() {
        let said = of(&["identify", "points.csv"]).unwrap();
        assert!(said.contains("`--measurements points.csv`") && !said.contains("--out"), "{said}");
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
        assert!(of(&["calibrate"]).unwrap().starts_with("`camera-check` calibrates the cameras"));
        assert!(of(&["camera-check", "x", "--square-size", "12"]).unwrap().contains("`--square-mm MM`"));
        assert!(of(&["verify", "--measurements", "x"]).unwrap().contains("`--against IDENTIFIED`"));
        assert!(of(&["camera-check", "l/1.png", "l/2.png", "l/3.PNG"]).unwrap().contains("by their folder"));
    }

    #[test]
    fn what_is_named_without_a_flag_is_said_and_so_are_flags_of_another_name() {
        for (words, says) in [
            (&["measure", "--poses", "x"][..], "it is named without a flag: `stereocal measure POSES`"),
            (
                &["locate", "--measurements", "x", "--robot", "r"],
                "it is named without a flag: `stereocal locate POSES`",
            ),
            (&["camera-check", "--images", "x"], "it is named without a flag: `stereocal camera-check IMAGES`"),
            (&["compensate", "--program", "x"], "it is named without a flag: `stereocal compensate TARGETS`"),
            (&["identify", "--table", "x"], "there is `--measurements FILE`"),
            (&["plan", "--measurements", "x"], "there is `--after MEASUREMENTS`"),
            (&["measure", "x", "--rig", "y"], "there is `--calibration FILE`"),
            (&["compensate", "x", "--only-targets"], "there is `--joint-targets-only`"),
        ] {
            assert_eq!(of(words).as_deref(), Some(says), "{words:?}");
        }
        assert_eq!(of(&["measure", "x", "--blur", "y"]), None);
    }

    #[test]
    fn usage_shows_what_a_command_takes_and_not_what_was_typed() {
        for words in
            [&["measure", "--poses", "x", "--square-mm", "10"][..], &["measure"], &["measure", "x", "--rig", "y"]]
        {
            let said = answered(words).0;
            assert!(said.contains("Usage: stereocal measure [OPTIONS] <POSES> [RIGHT]"), "{said}");
            assert!(!said.contains("to pass"), "{said}");
        }
    }

    #[test]
    fn tips_stay_where_they_are_a_slip_away() {
        for (typed, tip) in [
            (&["identfy"][..], Some("identify")),
            (&["identify", "--sed", "3"], Some("--seed")),
            (&["calibrate"], None),
            (&["camera-check", "x", "--square-size", "12"], None),
            (&["export", "calibration", "--format", "matlab"], None),
            (&["export", "calibration", "--format", "opncv"], Some("opencv")),
        ] {
            let said = answered(typed).0;
            assert_eq!(said.contains("tip:"), tip.is_some(), "{typed:?}: {said}");
            assert!(tip.is_none_or(|tip| said.contains(tip)), "{typed:?}: {said}");
        }
    }

    #[test]
    fn other_slips_are_left_to_the_parser() {
        assert_eq!(of(&["identify", "--sped", "3"]), None);
        assert_eq!(of(&["identify", "--seed", "x"]), None);
        assert_eq!(of(&["identfy", "points.csv"]), None);
    }
}

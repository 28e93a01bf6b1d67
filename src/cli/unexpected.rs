//! What was likely meant by a word that no command takes.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};

/// Names of values that are files or folders.
const PLACES: [&str; 2] = ["FILE", "DIR"];

/// For a file that is named without its flag: the flags that take one. `words` are those of the command line behind the program's name.
pub fn hint(root: &Command, words: &[String], error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return None };
    if error.kind() != ErrorKind::UnknownArgument || given.starts_with('-') {
        return None;
    }
    let command = words.iter().fold(root, |at, word| at.find_subcommand(word).unwrap_or(at));
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
    fn other_slips_are_left_to_the_parser() {
        assert_eq!(of(&["identify", "--sped", "3"]), None);
        assert_eq!(of(&["identify", "--seed", "x"]), None);
        assert_eq!(of(&["identfy", "points.csv"]), None);
    }
}

//! The guide's pages: the commands in their `sh` blocks are run one after the other in one clean folder. Those of the
//! page `day` are the run that the READMEs show.

use std::collections::BTreeSet;

use stereocal::guide::PAGES;

use crate::pipeline::as_in_the_contract;
use crate::readme::{Printed, show_this_run};
use crate::run::{stderr, stdout, stereocal, workplace};

/// The commands of a page, without the program's name.
fn commands(text: &str) -> Vec<Vec<&str>> {
    let mut found = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            command if inside => {
                let mut words = command.split_whitespace();
                assert_eq!(words.next(), Some("stereocal"), "{command}");
                found.push(words.collect());
            }
            _ => {}
        }
    }
    found
}

/// The files that stand in a page, by name.
fn files(text: &str) -> Vec<(&str, String)> {
    let blocks = text.split("```csv ").skip(1);
    blocks
        .map(|block| {
            let (name, rest) = block.split_once('\n').unwrap();
            (name, rest.split("```").next().unwrap().to_owned())
        })
        .collect()
}

#[test]
fn every_command_of_the_guide_does_what_it_says() {
    let folder = workplace();
    let (mut done, mut run) = (BTreeSet::new(), Vec::new());
    for page in PAGES {
        for (name, text) in files(page.text) {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        for command in commands(page.text) {
            // What stands on several pages is done once.
            if !done.insert(command.clone()) {
                continue;
            }
            let output = stereocal(folder.path(), &command);
            let status = output.status.code();
            assert_eq!(status, Some(0), "{}: {command:?}: {}{}", page.topic, stdout(&output), stderr(&output));
            if page.topic == "day" {
                run.push(Printed { command: format!("stereocal {}", command.join(" ")), stdout: stdout(&output) });
            }
        }
    }
    assert!(done.len() >= 8, "{} commands", done.len());
    as_in_the_contract(folder.path());
    show_this_run(&run);
}

#[test]
fn a_page_that_is_not_there_is_said_with_those_that_are() {
    let folder = workplace();
    let list = stdout(&stereocal(folder.path(), &["guide"]));
    for page in PAGES {
        assert!(list.contains(page.topic) && list.contains(page.title()), "{list}");
        assert_eq!(stdout(&stereocal(folder.path(), &["guide", page.topic])), page.plain());
    }
    assert!(stdout(&stereocal(folder.path(), &["guide", "--html", "book"])).contains("book/guide.html"));
    let book = std::fs::read_to_string(folder.path().join("book/guide.html")).unwrap();
    assert!(PAGES.iter().all(|page| book.contains(page.title())));
    let page = |asked: &str| stdout(&stereocal(folder.path(), &["guide", asked]));
    assert_eq!(page("Warnings"), page("warnings"));
    // Every command has a page, its own or one about it.
    let help = stdout(&stereocal(folder.path(), &["--help"]));
    let commands = help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    for command in
        commands.filter_map(|line| line.split_whitespace().next()).filter(|c| !["completions", "help"].contains(c))
    {
        assert!(page(command).starts_with("# "), "{command}");
    }
    let output = stereocal(folder.path(), &["guide", "nothing"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("no page `nothing`") && stderr(&output).contains("boards"), "{}", stderr(&output));
}

//! What is asked for before there is anything to run: starter files, the guide, the shell's completions and manual
//! pages.

pub mod guide;
pub mod init;
pub mod shell;

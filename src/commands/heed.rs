//! What a file's own words advise against, said to whoever uses it.

use camino::Utf8Path;

use crate::diagnostic::Status;
use crate::progress;
use crate::robot::Check;

/// Warns of what a robot's or a placement's own file says of its use; with which status a command that uses it ends at best.
pub fn heed(check: Option<&Check>, file: &Utf8Path) -> Status {
    check.and_then(|check| check.warning(file)).into_iter().for_each(progress::warn);
    if check.is_some_and(Check::is_against) { Status::OutOfTolerance } else { Status::Done }
}

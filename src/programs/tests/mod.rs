mod motions;
mod written;

//! Tests of findings: planted changes, and series in which nothing happened.

//! Answers what a cue says at a show time. Tick thread once built.

//! What one thread publishes and any other reads, without a lock and without waiting for each other. Every order of memory that
//! something rests on, but for that of the desk and the evidence, stands in here; `tests/models` tries it in every order in which
//! the threads may run and the memory may show what they wrote.

pub(crate) mod atomics;
mod words;

pub(crate) use words::{SharedWord, SharedWords};

#[cfg(test)]
mod tests;

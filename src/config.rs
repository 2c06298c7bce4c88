//! The configuration file: TOML in, checked configuration out, every fault with its line. Control thread.

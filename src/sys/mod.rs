//! System calls that the standard library lacks; the only unsafe code of the project, each block with its reason.

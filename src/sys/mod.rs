//! System calls that the standard library lacks; the only unsafe code of the project, each block with its reason.
//! Linux only. Any thread; nothing here allocates except where a refusal is put into words, and in `file` and `folder`, which are of the
//! control plane.

pub(crate) mod adjusted;
pub(crate) mod batch;
pub(crate) mod can;
pub(crate) mod child;
pub(crate) mod clock;
pub(crate) mod confined;
pub(crate) mod evdev;
pub(crate) mod file;
pub(crate) mod folder;
pub(crate) mod humble;
pub(crate) mod listen;
pub(crate) mod lock;
pub(crate) mod machine;
pub(crate) mod own_folder;
pub(crate) mod realtime;
#[cfg_attr(not(test), expect(dead_code, reason = "links of drives open lines in the next step"))]
pub(crate) mod serial;
pub(crate) mod signal;
pub(crate) mod terminal;
pub(crate) mod unix_socket;

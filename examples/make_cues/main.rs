//! Writes the cues that the project ships: `cargo run --example make_cues`. The same files come out each time.

use std::fs;
use std::io;
use std::path::Path;

mod files;
mod rides;
mod shapes;

fn main() -> io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cues");
    for (name, bytes) in files::all() {
        let path = folder.join(name);
        fs::write(&path, bytes)?;
        println!("{}", path.display());
    }
    Ok(())
}

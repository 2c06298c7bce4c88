//! Writes the cues that the project ships: `cargo run --example make_cues`. The same files come out each time.

use std::fs;
use std::io;
use std::path::Path;

mod rides;
mod shapes;

fn main() -> io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cues");
    for ride in rides::ALL {
        let path = folder.join(ride.file);
        fs::write(&path, ride.csv())?;
        println!("{}", path.display());
    }
    Ok(())
}

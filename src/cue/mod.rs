//! Cue files: reads them whole, checks every cell, and names each bad one. Control thread.

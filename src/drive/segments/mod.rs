//! From the poses of an axis to what a serial drive is sent, and to what it makes of that. Pure; allocates nothing.

mod fit;
mod knots;
mod middles;
mod model;
mod segment;

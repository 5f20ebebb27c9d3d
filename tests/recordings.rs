//! Runs of a small robot, recorded and read back.

mod damage;
mod dates;
mod journal;
mod kill;
mod moving;
mod played;
mod robot;
mod ros;
mod round_trip;
mod viewed;

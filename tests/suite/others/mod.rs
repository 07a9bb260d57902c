//! Files as people of the trade report them (`shared/data/reports`), each with its right value.

mod bodies;
mod garments;
mod meshes;
mod motions;
mod patterns;

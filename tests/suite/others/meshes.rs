//! Meshes as exporters write them.

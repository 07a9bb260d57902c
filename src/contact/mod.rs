//! Candidate pairs, continuous collision, distances and contact energies between moving triangles; it never steps time.

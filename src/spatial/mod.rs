//! Neighbours fast: BVH, grids, kd-tree (the only file naming kiddo), each beside its brute-force oracle.

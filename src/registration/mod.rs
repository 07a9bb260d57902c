//! Correspondences, robust kernels and Gauss–Newton that pull one surface onto another.

//! Sparse symmetric systems: assembly, factorisation, preconditioned iteration, with a report of how it went.

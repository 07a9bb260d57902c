//! One step of garment motion against a moving body: the real-time and the offline solvers.

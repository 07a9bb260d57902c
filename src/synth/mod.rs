//! Synthetic people, garments, cameras and sequences with known truth, for the demo, tests and benches.
